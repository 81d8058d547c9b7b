"""Rests of any length in one step: their moves, and what happened inside them.

In slots a rest of k moves by P0^k. Given the ends of such rests, X(i, j) = sum of
forward(i) backward(j), the expected moves within are P0 o M_k with

    M_k = sum_(n<k) Q^n X Q^(k-1-n),   Q = P0',

which doubling finds in log2(k) steps: M_2n = M_n Q^n + Q^n M_n and M_(n+1) = Q M_n +
X Q^n.
In time P0(d) = expm(G d), and the same with the integral over the rest in place of the
sum: the expected time in state i is M(i, i), the expected number of jumps from i to j
is G(i, j) M(i, j) (Hobolth and Jensen 2005; Van Loan 1978).
"""

import numpy as np

from learning.chain import Chain
from policies import Floats
from policies.compiled import compiled, inner

FEW = 0.5  # moves that are expected in a part of a rest
TERMS = 14  # of a series in steps of at most a half: below 1e-16


def moves_of(chain: Chain, lengths: Floats) -> Floats:
    """Return (D, S, S): the moves of rests of those lengths."""
    moves = np.empty((len(lengths), *chain.rest.shape))
    if chain.in_time:
        _moves_in_time(chain.rest, lengths, moves)
    else:
        _moves_in_slots(chain.rest, lengths.astype(np.int64), moves)
    return moves


def within(chain: Chain, lengths: Floats, ends: Floats) -> Floats:
    """Return (S, S): expected moves within rests; in time, seconds on the diagonal.

    Args:
        chain: whose rests they are.
        lengths: (D,).
        ends: (D, S, S) added up over the rests of each length.
    """
    total = np.zeros_like(chain.rest)
    rest = np.ascontiguousarray(chain.rest.T)
    if not chain.in_time:
        _within_slots(rest, lengths.astype(np.int64), ends, total)
        counted: Floats = total * chain.rest
        return counted
    _within_time(rest, lengths, ends, total)
    return np.where(np.eye(len(total), dtype=np.bool_), total, total * chain.rest)


@inner
def _times(left: Floats, right: Floats, into: Floats) -> None:
    """Write left @ right."""
    for i in range(left.shape[0]):
        for j in range(left.shape[0]):
            total = 0.0
            for k in range(left.shape[0]):
                total += left[i, k] * right[k, j]
            into[i, j] = total


@inner
def _add_times(left: Floats, right: Floats, into: Floats) -> None:
    """Add left @ right."""
    for i in range(left.shape[0]):
        for j in range(left.shape[0]):
            total = into[i, j]
            for k in range(left.shape[0]):
                total += left[i, k] * right[k, j]
            into[i, j] = total


@compiled
def _moves_in_slots(rest: Floats, lengths: Floats, moves: Floats) -> None:
    size = rest.shape[0]
    bits = 1
    while lengths[-1] >> bits:
        bits += 1
    powers = np.empty((bits, size, size))
    powers[0] = rest
    for b in range(1, bits):
        _times(powers[b - 1], powers[b - 1], powers[b])
    beside = np.empty((size, size))
    for d in range(len(lengths)):
        moves[d] = np.eye(size)
        for b in range(bits):
            if lengths[d] >> b & 1:
                _times(moves[d], powers[b], beside)
                moves[d] = beside


@compiled
def _within_slots(rest: Floats, lengths: Floats, ends: Floats, total: Floats) -> None:
    size = rest.shape[0]
    moved, inside = np.empty((size, size)), np.empty((size, size))
    beside = np.empty((size, size))
    for d in range(len(lengths)):
        k = lengths[d]
        if k == 0:
            continue
        bits = 0
        while k >> (bits + 1):
            bits += 1
        moved[:] = rest
        inside[:] = ends[d]
        for b in range(bits - 1, -1, -1):
            _times(inside, moved, beside)
            _add_times(moved, inside, beside)
            inside[:] = beside
            _times(moved, moved, beside)
            moved[:] = beside
            if k >> b & 1:
                _times(rest, inside, beside)
                _add_times(ends[d], moved, beside)
                inside[:] = beside
                _times(rest, moved, beside)
                moved[:] = beside
        total += inside


@inner
def _halvings(generator: Floats, length: float) -> int:
    """Return how often a rest is halved until few moves are expected in a part."""
    fastest = 0.0
    for i in range(generator.shape[0]):
        fastest = max(fastest, -generator[i, i])
    halvings = 0
    while fastest * length > FEW:
        length /= 2
        halvings += 1
    return halvings


@compiled
def _moves_in_time(generator: Floats, lengths: Floats, moves: Floats) -> None:
    size = generator.shape[0]
    term, beside = np.empty((size, size)), np.empty((size, size))
    for d in range(len(lengths)):
        halvings = _halvings(generator, lengths[d])
        step = lengths[d] / 2.0**halvings
        moves[d] = np.eye(size)
        term[:] = np.eye(size)
        for n in range(1, TERMS):
            _times(term, generator, beside)
            term[:] = beside * (step / n)
            moves[d] += term
        for _ in range(halvings):
            _times(moves[d], moves[d], beside)
            moves[d] = beside


@compiled
def _within_time(
    generator: Floats, lengths: Floats, ends: Floats, total: Floats
) -> None:
    """Add the integral of expm(Q s) X expm(Q (d - s)) over s; Q = `generator`."""
    size = generator.shape[0]
    term, beside = np.empty((size, size)), np.empty((size, size))
    power, moved = np.empty((size, size)), np.empty((size, size))
    inside = np.empty((size, size))
    for d in range(len(lengths)):
        halvings = _halvings(generator, lengths[d])
        step = lengths[d] / 2.0**halvings
        # term n: sum of Q^p X Q^q over p + q = n - 1, times step^n / n!
        term[:] = ends[d] * step
        inside[:] = term
        power[:] = np.eye(size)
        moved[:] = power
        for n in range(1, TERMS):
            _times(power, generator, beside)
            power[:] = beside * (step / n)
            moved += power
            _times(generator, term, beside)
            term[:] = beside * (step / (n + 1))
            _times(ends[d], power, beside)
            term += beside * (step / (n + 1))
            inside += term
        for _ in range(halvings):
            _times(inside, moved, beside)
            _add_times(moved, inside, beside)
            inside[:] = beside
            _times(moved, moved, beside)
            moved[:] = beside
        total += inside
