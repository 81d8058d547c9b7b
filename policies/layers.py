"""Functions of beliefs, kept on the grids of several models, for compiled code."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from policies import grid
from policies.arrays import Floats, Ints


class Layers(NamedTuple):
    """L functions of a belief for each of M models.

    Attributes:
        steps: see `grid.steps`, for all the models.
        states: (M,) number of states.
        divisions: (M,) of each model's grid.
        start: (M,) where a model's values begin.
        size: (M,) points of its grid; its layers lie one after the other.
        values: all values.
    """

    steps: Ints
    states: Ints
    divisions: Ints
    start: Ints
    size: Ints
    values: Floats


def stacked(
    states: Sequence[int], divisions: Sequence[int], values: Sequence[Floats]
) -> Layers:
    """Lay down each model's values (L, P), on the grid of its divisions."""
    sizes = np.array([value.shape[-1] for value in values], dtype=np.int64)
    ends = np.cumsum([value.size for value in values], dtype=np.int64)
    return Layers(
        grid.steps(max(states, default=2), max(divisions, default=1)),
        np.array(states, dtype=np.int64),
        np.array(divisions, dtype=np.int64),
        np.concatenate((np.zeros(1, dtype=np.int64), ends))[:-1],
        sizes,
        np.concatenate([value.ravel() for value in values] or [np.empty(0)]),
    )
