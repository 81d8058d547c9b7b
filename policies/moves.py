"""How beliefs move in imagination: the models, made for many small steps."""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.compiled import inner
from policies.model_set import ModelSet


class Moves(NamedTuple):
    """M models of S states and K signals.

    Attributes:
        like: (M, S), expected reward.
        rest: (M, S, S), P0.
        observe: (M, K, S), chance of each signal by state.
        told: (M, K, S, S): a signal and a move by a play, O(i, y) P1(i, j).
        reward: (M, K), worth of each signal.
        signals: (M,) number of signals.
    """

    like: Floats
    rest: Floats
    observe: Floats
    told: Floats
    reward: Floats
    signals: Ints


def moves(models: ModelSet) -> Moves:
    """Multiply chances of signals and moves."""
    told = models.observe[..., None] * models.play[:, None]
    return Moves(
        models.like,
        models.rest,
        models.observe,
        np.ascontiguousarray(told),
        models.reward,
        models.signals,
    )


@inner
def tell(
    moves: Moves, m: int, signal: int, belief: Floats, row: int, after: Floats, to: int
) -> float:
    """Write the belief after a play of model m and its signal into after[to].

    Returns the chance of the signal; if that is 0, nothing sensible is written.
    """
    chance = 0.0
    for j in range(belief.shape[1]):
        weight = 0.0
        for i in range(belief.shape[1]):
            weight += belief[row, i] * moves.told[m, signal, i, j]
        after[to, j] = weight
        chance += weight
    for j in range(belief.shape[1]):
        after[to, j] /= chance
    return chance
