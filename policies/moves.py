"""How beliefs move in imagination: the models, made for many small steps."""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.bayes import like_chance
from policies.compiled import inner
from policies.model_set import ModelSet
from policies.mood import Rule


class Moves(NamedTuple):
    """M models of S states and K signals, in C moods.

    Attributes:
        like: (M C, S), expected reward; model m in mood c in row m C + c. Where C is
            not 1, M rows follow: those of the mean mood.
        rest: (M, S, S), P0.
        observe: (M C, K, S), chance of each signal by state.
        told: (M C, K, S, S): a signal and a move by a play, O(i, y) P1(i, j).
        reward: (M, K), worth of each signal.
        signals: (M,) number of signals.
        classes: C.
        moody: empty where C is 1: a type of its own, so that code for moods is left out
            when compiling.
        rule: by which answers make a mood, see `mood`.
    """

    like: Floats
    rest: Floats
    observe: Floats
    told: Floats
    reward: Floats
    signals: Ints
    classes: int
    moody: tuple[int, ...]
    rule: Rule


def moves(models: ModelSet) -> Moves:
    """Multiply chances of signals and moves."""
    play = np.repeat(models.play, models.classes, axis=0)
    told = models.observe_in[..., None] * play[:, None]
    like = models.like_in
    if models.classes > 1:
        like = np.concatenate((like, models.like))
    return Moves(
        like,
        models.rest,
        models.observe_in,
        np.ascontiguousarray(told),
        models.reward,
        models.signals,
        models.classes,
        (1,) if models.classes > 1 else (),
        models.rule,
    )


@inner
def are_moody(moves: Moves) -> bool:
    """Return whether there are moods, which is known when compiling."""
    return len(moves.moody) > 0


@inner
def row_in(moves: Moves, m: int, mood: int) -> int:
    """Return the row of what model m is in a mood."""
    return m * moves.classes + mood if len(moves.moody) > 0 else m


@inner
def lift_of(moves: Moves, m: int, mood: int, belief: Floats, row: int) -> float:
    """Return by how much a mood changes the reward of model m from the mean one."""
    models = len(moves.rest)
    now = like_chance(moves.like, m * moves.classes + mood, belief, row)
    return now - like_chance(moves.like, models * moves.classes + m, belief, row)


@inner
def tell(
    moves: Moves,
    chances: int,
    signal: int,
    belief: Floats,
    row: int,
    after: Floats,
    to: int,
) -> float:
    """Write the belief after a play and its signal into after[to].

    `chances` is the row of the model in the mood of the play.

    Returns the chance of the signal; if that is 0, nothing sensible is written.
    """
    chance = 0.0
    for j in range(belief.shape[1]):
        weight = 0.0
        for i in range(belief.shape[1]):
            weight += belief[row, i] * moves.told[chances, signal, i, j]
        after[to, j] = weight
        chance += weight
    for j in range(belief.shape[1]):
        after[to, j] /= chance
    return chance
