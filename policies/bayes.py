"""The arithmetic of beliefs, compiled; `belief` says what it means.

Inner functions take whole arrays and rows of them: a view costs more than the sum it is
made for. Sums run over states in ascending order, so states that a model is padded with
change no bit of a result.
"""

import numpy as np

from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner
from policies.model_set import ModelSet

NONE = -1  # no answer; signals count from 0 in the order of their model
SKIP = 0
LIKE = 1

IMPOSSIBLE = float(np.finfo(np.float64).tiny)


@inner
def like_chance(like: Floats, m: int, belief: Floats, row: int) -> float:
    """Return r(pi), at most 1, of a row of beliefs (R, S), by row m of (M, S)."""
    chance = 0.0
    for i in range(belief.shape[1]):
        chance += belief[row, i] * like[m, i]
    return min(chance, 1.0)


@inner
def move(
    matrices: Floats, m: int, belief: Floats, row: int, after: Floats, to: int
) -> None:
    """Write belief[row] @ matrices[m] into after[to], another row.

    Args:
        matrices: (M, S, S).
        m: row of the matrix.
        belief: (R, S).
        row: row of the belief.
        after: (Q, S).
        to: row of the result.
    """
    for j in range(belief.shape[1]):
        weight = 0.0
        for i in range(belief.shape[1]):
            weight += belief[row, i] * matrices[m, i, j]
        after[to, j] = weight


@inner
def learn(
    observe: Floats,
    row_of: int,
    play: Floats,
    m: int,
    belief: Floats,
    row: int,
    signal: int,
    after: Floats,
    to: int,
) -> float:
    """Write the belief after a play and its signal into after[to]; see `move`.

    Args:
        observe: (R, K, S), chance of each signal by state.
        row_of: row of the model's chances, in the mood of the play.
        play: (M, S, S), moves.
        m: row of the model.
        belief: (R, S).
        row: row of the belief.
        signal: given, or NONE.
        after: (Q, S).
        to: row of the result.

    Returns the chance of the signal. Below IMPOSSIBLE the belief has moved as without
    an answer.
    """
    chance = _learn(observe, row_of, play, m, belief, row, signal, after, to)
    if chance < IMPOSSIBLE:
        _learn(observe, row_of, play, m, belief, row, NONE, after, to)
    return 1.0 if signal == NONE else chance


@inner
def _learn(
    observe: Floats,
    row_of: int,
    play: Floats,
    m: int,
    belief: Floats,
    row: int,
    signal: int,
    after: Floats,
    to: int,
) -> float:
    chance = 0.0
    for i in range(belief.shape[1]):
        told = 1.0 if signal == NONE else observe[row_of, signal, i]
        chance += belief[row, i] * told
    for j in range(belief.shape[1]):
        weight = 0.0
        for i in range(belief.shape[1]):
            told = 1.0 if signal == NONE else observe[row_of, signal, i]
            weight += belief[row, i] * told * play[m, i, j]
        after[to, j] = weight / chance
    return chance


@compiled
def _rest(
    powers: Floats, m: int, belief: Floats, row: int, slots: int, spare: Floats
) -> None:
    """Move belief[row] on by slots of rest, in place; `spare` is (1, S)."""
    level = 0
    while slots > 0 and level < powers.shape[1]:
        if slots & 1:
            move(powers[m], level, belief, row, spare, 0)
            belief[row] = spare[0]
        slots >>= 1
        level += 1


@compiled
def rested(powers: Floats, model: Ints, belief: Floats, slots: Ints) -> Floats:
    """See `belief.rested`; `powers` as `ModelSet` has them."""
    after = belief.copy()
    spare = np.empty((1, belief.shape[1]))
    for k in range(len(after)):
        _rest(powers, model[k], after, k, slots[k], spare)
    return after


@compiled
def expected_like(like: Floats, rows: Ints, belief: Floats) -> Floats:
    """See `belief.expected_like`; `rows` (K,) of `like` (R, S)."""
    chances = np.empty(len(rows))
    for k in range(len(rows)):
        chances[k] = like_chance(like, rows[k], belief, k)
    return chances


@compiled
def answered(
    observe: Floats, row_of: int, play: Floats, m: int, belief: Floats, signal: int
) -> tuple[Floats, float]:
    """Return the belief after a play and the chance of its signal."""
    after = np.empty((1, len(belief)))
    chance = learn(observe, row_of, play, m, belief.reshape(1, -1), 0, signal, after, 0)
    return after[0], chance


@compiled
def replayed(
    models: ModelSet, m: int, slots: Ints, signals: Ints, moods: Ints
) -> tuple[int, Floats]:
    """See `belief.replayed`; `moods` may be empty: 0, all."""
    belief = models.prior[m : m + 1].copy()
    spare = np.empty_like(belief)
    slot, row_of = 0, m * models.classes
    for p in range(len(slots)):
        _rest(models.rest_powers, m, belief, 0, slots[p] - slot, spare)
        if len(moods) > 0:
            row_of = m * models.classes + moods[p]
        learn(
            models.observe_in, row_of, models.play, m, belief, 0, signals[p], spare, 0
        )
        belief[0] = spare[0]
        slot = slots[p] + 1
    return slot, belief[0]


@compiled
def forecast(
    rest: Floats, m: int, like: Floats, row_of: int, belief: Floats, slots: int
) -> Floats:
    """See `belief.forecast`; `row_of` the model in a mood, in `like`."""
    beliefs = np.empty((slots + 1, len(belief)))
    beliefs[0] = belief
    for k in range(slots):
        move(rest, m, beliefs, k, beliefs, k + 1)
    return expected_like(like, np.full(slots, row_of), beliefs[1:])
