"""Paths of hidden states, drawn as likely as they are: forward, then backward.

Fruehwirth-Schnatter (1994), Carter and Kohn (1994). What is drawn are the states at
plays, and after their moves; `bridges` draws what lies within rests.
"""

from typing import NamedTuple

import numpy as np

from learning.passes import Path, Seen, Steps, onward
from policies import Floats, Ints
from policies.compiled import compiled, inner


class Drawn(NamedTuple):
    """What was met along paths.

    Attributes:
        played: (S, S) moves by plays.
        ends: (D, S, S) rests by length: the state before, and that after.
        observed: (M, S, K) signals by mood and state.
        begun: (S,) first states.
    """

    played: Ints
    ends: Ints
    observed: Ints
    begun: Ints


@compiled
def draw(seen: Seen, steps: Steps, share: Floats, drawn: Drawn) -> None:
    """Add up what one path of each stream meets.

    Args:
        seen: N streams of P plays.
        steps: the chain.
        share: (N + 2 P,) uniform in [0, 1).
        drawn: to add to.
    """
    size, longest = len(steps.prior), 0
    for n in range(len(seen.first) - 1):
        longest = max(longest, seen.first[n + 1] - seen.first[n])
    path = Path(
        np.empty((longest, size)),
        np.empty((longest, size)),
        np.empty((longest + 1, size)),
        np.empty(longest),
        np.empty((1, size)),
        np.empty((1, size)),
    )
    for n in range(len(seen.first) - 1):
        begin, plays = seen.first[n], seen.first[n + 1] - seen.first[n]
        onward(seen, steps, path, begin, plays)
        _back(seen, steps, path, begin, plays, share, n + 2 * begin, drawn)


@inner
def _back(
    seen: Seen,
    steps: Steps,
    path: Path,
    begin: int,
    plays: int,
    share: Floats,
    at: int,
    drawn: Drawn,
) -> None:
    state = _last(path, plays - 1, share[at])
    for t in range(plays - 1, -1, -1):
        p = begin + t
        if seen.answer[p] >= 0:
            drawn.observed[seen.mood[p], state, seen.answer[p]] += 1
        before = _before_rest(steps, path, t, seen.rest[p], state, share[at + 1])
        drawn.ends[seen.rest[p], before, state] += 1
        if t == 0:
            drawn.begun[before] += 1
        else:
            state = _before_move(steps, path, t - 1, before, share[at + 2])
            drawn.played[state, before] += 1
        at += 2


@inner
def _last(path: Path, t: int, share: float) -> int:
    """Draw the state at the last play, given all answers."""
    size, total = path.weighed.shape[1], 0.0
    for i in range(size):
        total += path.weighed[t, i]
    left, state = share * total, 0
    for i in range(size):
        if path.weighed[t, i] > 0.0 and left >= 0.0:
            state = i
            left -= path.weighed[t, i]
    return state


@inner
def _before_rest(
    steps: Steps, path: Path, t: int, r: int, after: int, share: float
) -> int:
    """Draw the state before the rest before play t, given that after it."""
    size, total = path.moved.shape[1], 0.0
    for i in range(size):
        total += path.moved[t, i] * steps.rests[r, i, after]
    left, state = share * total, 0
    for i in range(size):
        weight = path.moved[t, i] * steps.rests[r, i, after]
        if weight > 0.0 and left >= 0.0:
            state = i
            left -= weight
    return state


@inner
def _before_move(steps: Steps, path: Path, t: int, after: int, share: float) -> int:
    """Draw the state at play t, given that after its move."""
    size, total = path.weighed.shape[1], 0.0
    for i in range(size):
        total += path.weighed[t, i] * steps.play[i, after]
    left, state = share * total, 0
    for i in range(size):
        weight = path.weighed[t, i] * steps.play[i, after]
        if weight > 0.0 and left >= 0.0:
            state = i
            left -= weight
    return state
