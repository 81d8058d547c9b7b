"""The random numbers of a rollout: who gives which signal, what a random base plays."""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats
from policies.compiled import compiled
from policies.randomness import ANSWERS, ITEMS, uniform

_LEVELS = 64  # more than a trajectory has plays: candidates get positions of their own


class Draws(NamedTuple):
    """Random numbers of T plays in each of L trajectories, all in [0, 1).

    Attributes:
        answers: (T, L) which signals are given.
        items: (T, L) which items a random base plays; (0, L) otherwise.
    """

    answers: Floats
    items: Floats


@compiled
def empty_draws(levels: int, trajectories: int, random: bool) -> Draws:
    """Make room for the random numbers of one first action."""
    return Draws(
        np.empty((levels, trajectories)),
        np.empty((levels if random else 0, trajectories)),
    )


@compiled
def draw(draws: Draws, seed: int, candidate: int) -> None:
    """Fill `draws` for a first action.

    First actions that pass the same `candidate` share all random numbers.
    """
    levels, trajectories = draws.answers.shape
    for h in range(levels):
        position = candidate * _LEVELS + h
        for t in range(trajectories):
            draws.answers[h, t] = uniform(seed, ANSWERS, t, position)
    for h in range(len(draws.items)):
        position = candidate * _LEVELS + h
        for t in range(trajectories):
            draws.items[h, t] = uniform(seed, ITEMS, t, position)
