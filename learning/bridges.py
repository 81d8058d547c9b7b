"""What happened within rests of known ends, drawn as likely as it is.

A rest of d slots from i to j passes m in its middle with chance proportional to
P0^h(i, m) P0^(d-h)(m, j), and is then two shorter rests of known ends. Of many rests
only how many there are of each length and ends matters, so all of a length are cut at
once, the longest first, until all are of one slot: then they are moves. So a rest takes
time by the logarithm of its length, and nothing is approximated.
"""

import numpy as np

from learning.chain import Chain
from learning.rests import moves_of
from policies import Floats, Ints


def halved(lengths: Ints) -> Ints:
    """Return (E,): the lengths that rests are cut into, and their own, ascending."""
    found = {0, 1, *lengths.tolist()}
    left = list(found)
    while left:
        length = left.pop()
        halves = {length // 2, length - length // 2} - found
        found |= halves
        left += halves
    return np.array(sorted(found), dtype=np.int64)


def moves_within(
    chain: Chain, lengths: Ints, ends: Ints, rng: np.random.Generator
) -> Ints:
    """Return (S, S): how many moves of each kind there were within rests.

    Args:
        chain: whose rests they are, in slots.
        lengths: (E,) from `halved`.
        ends: (E, S, S) rests by length, state before and state after.
        rng: for all draws.
    """
    rests, moves = ends.copy(), moves_of(chain, lengths.astype(np.float64))
    most = int(lengths[-1])
    while most > 1:
        half = most - most // 2
        cut = np.flatnonzero((lengths > half) & (lengths <= most))
        short = lengths[cut] // 2
        first = np.searchsorted(lengths, short)
        second = np.searchsorted(lengths, lengths[cut] - short)
        middle = rng.multinomial(rests[cut], _middles(moves[first], moves[second]))
        np.add.at(rests, first, middle.sum(axis=2))
        np.add.at(rests, second, middle.sum(axis=1).transpose(0, 2, 1))
        most = half
    [one] = rests[lengths == 1]
    return np.asarray(one, dtype=np.int64)


def _middles(first: Floats, second: Floats) -> Floats:
    """Return (D, S, S, S): the chance of each state midway, by both ends."""
    ways = np.einsum("dim,dmj->dijm", first, second)
    total = ways.sum(axis=-1, keepdims=True)
    even = np.full_like(ways, 1 / ways.shape[-1])
    found: Floats = np.divide(ways, total, out=even, where=total > 0)
    return found
