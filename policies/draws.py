"""The random numbers of a rollout: who likes what, and what a random base plays."""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.compiled import compiled
from policies.randomness import ANSWERS, ITEMS, uniform

_DEPTHS = 64  # more than a trajectory has plays: candidates get positions of their own


class Plan(NamedTuple):
    """A rollout's parameters as compiled code takes them.

    Attributes:
        weights: (D,) worth of the reward of each play, the first action's included.
        trajectories: L.
        random: whether the base plays at random, else it is myopic.
        click: whether a reward is the answer, else its chance.
        common: whether first actions share their random numbers.
    """

    weights: Floats
    trajectories: int
    random: bool
    click: bool
    common: bool


class Draws(NamedTuple):
    """Random numbers of D plays in each of L trajectories.

    Attributes:
        answers: (D, L) in [0, 1), a play is liked if its chance lies above.
        items: (D, L) ordinals of the items that a random base plays; (0, L) otherwise.
    """

    answers: Floats
    items: Ints


@compiled
def empty_draws(plan: Plan) -> Draws:
    """Make room for the random numbers of one first action."""
    plays = len(plan.weights)
    return Draws(
        np.empty((plays, plan.trajectories)),
        np.empty((plays if plan.random else 0, plan.trajectories), dtype=np.int64),
    )


@compiled
def draw(draws: Draws, seed: int, candidate: int, total: int) -> None:
    """Fill `draws` for a first action, choosing uniformly among `total` items.

    First actions that pass the same `candidate` share all random numbers.
    """
    plays, trajectories = draws.answers.shape
    for h in range(plays):
        position = candidate * _DEPTHS + h
        for t in range(trajectories):
            draws.answers[h, t] = uniform(seed, ANSWERS, t, position)
    for h in range(len(draws.items)):
        position = candidate * _DEPTHS + h
        for t in range(trajectories):
            draws.items[h, t] = int(uniform(seed, ITEMS, t, position) * total)
