"""Forward and backward over a stream, compiled; `expectation` says what for."""

from typing import NamedTuple

import numpy as np

from policies import Floats, Ints
from policies.compiled import compiled, inner

LEAST = 1e-300  # chance of what cannot happen


class Seen(NamedTuple):
    """See `Streams`: (N + 1,) first, and (P,) answer, mood and rest."""

    first: Ints
    answer: Ints
    mood: Ints
    rest: Ints


class Steps(NamedTuple):
    """A chain: (S, S) play, (D, S, S) rests, (M, S, K) observe, (S,) prior."""

    play: Floats
    rests: Floats
    observe: Floats
    prior: Floats


class Path(NamedTuple):
    """One stream of up to L plays, play by play.

    Attributes:
        believed: (L, S) belief before the play.
        weighed: (L, S) the same after its answer.
        moved: (L + 1, S) the same after its move; row 0: the prior.
        chance: (L,) of its answer.
        later: (1, S) chance of all that comes from a play on, by state before it.
        ahead: (1, S) chance of all that comes after a play, by state after its move.
    """

    believed: Floats
    weighed: Floats
    moved: Floats
    chance: Floats
    later: Floats
    ahead: Floats


class Found(NamedTuple):
    """Sums over streams.

    Attributes:
        played: (S, S) to be multiplied by the moves of a play.
        ends: (D, S, S) of rests by length: belief before, chance of what comes after.
        observed: (M, S, K) signals by mood and state.
        begun: (S,) to be multiplied by the prior.
        likelihood: (N,) ln of the chance of each stream's answers.
    """

    played: Floats
    ends: Floats
    observed: Floats
    begun: Floats
    likelihood: Floats


@inner
def _told(steps: Steps, mood: int, i: int, answer: int) -> float:
    """Return the chance of an answer in state i; of none, one."""
    return 1.0 if answer < 0 else steps.observe[mood, i, answer]


@compiled
def both_ways(seen: Seen, steps: Steps, weight: Floats, found: Found) -> None:
    """Add up what is expected of each stream, times its weight (N,)."""
    size, longest = len(steps.prior), 0
    for n in range(len(weight)):
        longest = max(longest, seen.first[n + 1] - seen.first[n])
    path = Path(
        np.empty((longest, size)),
        np.empty((longest, size)),
        np.empty((longest + 1, size)),
        np.empty(longest),
        np.empty((1, size)),
        np.empty((1, size)),
    )
    for n in range(len(weight)):
        begin, plays = seen.first[n], seen.first[n + 1] - seen.first[n]
        found.likelihood[n] = onward(seen, steps, path, begin, plays)
        if weight[n] > 0.0:
            _backward(seen, steps, path, begin, plays, weight[n], found)


@inner
def onward(seen: Seen, steps: Steps, path: Path, begin: int, plays: int) -> float:
    """Write beliefs along a stream; return ln of the chance of its answers."""
    size, likelihood = len(steps.prior), 0.0
    for i in range(size):
        path.moved[0, i] = steps.prior[i]
    for t in range(plays):
        p, chance = begin + t, 0.0
        for j in range(size):
            total = 0.0
            for i in range(size):
                total += path.moved[t, i] * steps.rests[seen.rest[p], i, j]
            path.believed[t, j] = total
            weighed = total * _told(steps, seen.mood[p], j, seen.answer[p])
            path.weighed[t, j] = weighed
            chance += weighed
        path.chance[t] = max(chance, LEAST)
        likelihood += np.log(path.chance[t])
        for j in range(size):
            path.weighed[t, j] /= path.chance[t]
        for j in range(size):
            total = 0.0
            for i in range(size):
                total += path.weighed[t, i] * steps.play[i, j]
            path.moved[t + 1, j] = total
    return likelihood


@inner
def _backward(
    seen: Seen,
    steps: Steps,
    path: Path,
    begin: int,
    plays: int,
    weight: float,
    found: Found,
) -> None:
    for t in range(plays - 1, -1, -1):
        p = begin + t
        last = t == plays - 1  # moves after the last play are nobody's
        if not last:
            _look_ahead(steps, path, seen.rest[p + 1], t, weight, found)
        for i in range(len(steps.prior)):
            after = 1.0
            if not last:
                after = 0.0
                for j in range(len(steps.prior)):
                    after += steps.play[i, j] * path.ahead[0, j]
            told = _told(steps, seen.mood[p], i, seen.answer[p])
            path.later[0, i] = told * after / path.chance[t]
        if seen.answer[p] >= 0:
            for i in range(len(steps.prior)):
                share = weight * path.believed[t, i] * path.later[0, i]
                found.observed[seen.mood[p], i, seen.answer[p]] += share
    r = seen.rest[begin]
    for i in range(len(steps.prior)):
        total = 0.0
        for j in range(len(steps.prior)):
            total += steps.rests[r, i, j] * path.later[0, j]
            found.ends[r, i, j] += weight * steps.prior[i] * path.later[0, j]
        found.begun[i] += weight * total


@inner
def _look_ahead(
    steps: Steps, path: Path, r: int, t: int, weight: float, found: Found
) -> None:
    """Go back over a rest, and count the move of play t and the ends of the rest."""
    size = len(steps.prior)
    for i in range(size):
        total, left = 0.0, weight * path.moved[t + 1, i]
        for j in range(size):
            total += steps.rests[r, i, j] * path.later[0, j]
            found.ends[r, i, j] += left * path.later[0, j]
        path.ahead[0, i] = total
    for i in range(size):
        left = weight * path.weighed[t, i]
        for j in range(size):
            found.played[i, j] += left * path.ahead[0, j]


@compiled
def forward(seen: Seen, steps: Steps, chance: Floats) -> None:
    """Write the chances of the signals before each play, (P, K)."""
    size = len(steps.prior)
    belief, after = np.empty(size), np.empty(size)
    for n in range(len(seen.first) - 1):
        after[:] = steps.prior
        for p in range(seen.first[n], seen.first[n + 1]):
            for j in range(size):
                belief[j] = 0.0
                for i in range(size):
                    belief[j] += after[i] * steps.rests[seen.rest[p], i, j]
            for k in range(steps.observe.shape[2]):
                chance[p, k] = 0.0
                for j in range(size):
                    chance[p, k] += belief[j] * steps.observe[seen.mood[p], j, k]
            _learn(steps, seen.mood[p], seen.answer[p], belief, after)


@inner
def _learn(steps: Steps, mood: int, answer: int, belief: Floats, after: Floats) -> None:
    """Write the belief after a play."""
    size, chance = len(belief), 0.0
    for i in range(size):
        belief[i] *= _told(steps, mood, i, answer)
        chance += belief[i]
    for j in range(size):
        after[j] = 0.0
        for i in range(size):
            after[j] += belief[i] * steps.play[i, j] / max(chance, LEAST)
