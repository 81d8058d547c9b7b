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
    models: ModelSet,
    m: int,
    mood: int,
    belief: Floats,
    row: int,
    signal: int,
    after: Floats,
    to: int,
) -> float:
    """Write the belief after a play of model m in a mood into after[to]; see `move`.

    Returns the chance of the signal. Below IMPOSSIBLE the belief has moved as without
    an answer.
    """
    chances = m * models.classes + mood
    chance = _learn(models, m, chances, belief, row, signal, after, to)
    if chance < IMPOSSIBLE:
        _learn(models, m, chances, belief, row, NONE, after, to)
    return 1.0 if signal == NONE else chance


@inner
def _learn(
    models: ModelSet,
    m: int,
    chances: int,
    belief: Floats,
    row: int,
    signal: int,
    after: Floats,
    to: int,
) -> float:
    chance = 0.0
    for i in range(belief.shape[1]):
        told = 1.0 if signal == NONE else models.observe_in[chances, signal, i]
        chance += belief[row, i] * told
    for j in range(belief.shape[1]):
        weight = 0.0
        for i in range(belief.shape[1]):
            told = 1.0 if signal == NONE else models.observe_in[chances, signal, i]
            weight += belief[row, i] * told * models.play[m, i, j]
        after[to, j] = weight / chance
    return chance


@compiled
def _rest(
    models: ModelSet, m: int, belief: Floats, row: int, slots: int, spare: Floats
) -> None:
    """Move belief[row] on by slots of rest, in place; `spare` is (1, S)."""
    level = 0
    while slots > 0 and level < models.rest_powers.shape[1]:
        if slots & 1:
            move(models.rest_powers[m], level, belief, row, spare, 0)
            belief[row] = spare[0]
        slots >>= 1
        level += 1


@compiled
def rested(models: ModelSet, model: Ints, belief: Floats, slots: Ints) -> Floats:
    """See `belief.rested`."""
    after = belief.copy()
    spare = np.empty((1, belief.shape[1]))
    for k in range(len(after)):
        _rest(models, model[k], after, k, slots[k], spare)
    return after


@compiled
def expected_like(like: Floats, model: Ints, belief: Floats) -> Floats:
    """See `belief.expected_like`; `like` is (M, S), or (M C, S) and `model` a row."""
    chances = np.empty(len(model))
    for k in range(len(model)):
        chances[k] = like_chance(like, model[k], belief, k)
    return chances


@compiled
def answered(
    models: ModelSet, m: int, mood: int, belief: Floats, signal: int
) -> tuple[Floats, float]:
    """Return the belief after a play and the chance of its signal."""
    after = np.empty((1, len(belief)))
    chance = learn(models, m, mood, belief.reshape(1, -1), 0, signal, after, 0)
    return after[0], chance


@compiled
def replayed(
    models: ModelSet, m: int, slots: Ints, signals: Ints, moods: Ints
) -> tuple[int, Floats]:
    """See `belief.replayed`."""
    belief = models.prior[m : m + 1].copy()
    spare = np.empty_like(belief)
    slot = 0
    for p in range(len(slots)):
        _rest(models, m, belief, 0, slots[p] - slot, spare)
        learn(models, m, moods[p], belief, 0, signals[p], spare, 0)
        belief[0] = spare[0]
        slot = slots[p] + 1
    return slot, belief[0]


@compiled
def forecast(models: ModelSet, m: int, belief: Floats, slots: int, mood: int) -> Floats:
    """See `belief.forecast`."""
    beliefs = np.empty((slots + 1, len(belief)))
    beliefs[0] = belief
    for k in range(slots):
        move(models.rest, m, beliefs, k, beliefs, k + 1)
    rows = np.full(slots, m * models.classes + mood)
    return expected_like(models.like_in, rows, beliefs[1:])
