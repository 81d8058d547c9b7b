"""Functions of beliefs, kept on the grids of several models, for compiled code."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from policies import grid
from policies.arrays import Floats, Ints
from policies.compiled import inner


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


@inner
def find(
    layers: Layers, m: int, belief: Floats, row: int, corners: grid.Corners
) -> None:
    """Locate belief[row] in the grid of model m."""
    grid.locate(
        layers.steps, layers.states[m], layers.divisions[m], belief, row, corners
    )


@inner
def value_at(layers: Layers, m: int, layer: int, corners: grid.Corners) -> float:
    """Return the value of a layer of model m at a belief that `find` has located."""
    start = layers.start[m] + layer * layers.size[m]
    return float(grid.interpolated(layers.values, start, layers.states[m], corners))
