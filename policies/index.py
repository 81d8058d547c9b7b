"""Functions of a model and a belief, by which items are ranked or valued.

A function is linear in the belief, or kept in layers on a grid, where between two
layers it is a mixture of both. Several of them are stacked, to be told apart by number.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from policies import grid
from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner
from policies.layers import Layers

LINEAR = -1
BY_REST = -2
PLACE = np.dtype(
    [
        ("layer", np.int64),  # the first one; or LINEAR, or BY_REST: slots of rest
        ("blend", np.float64),  # share of the layer after it
        ("start", np.int64),  # where the layers begin among the values
        ("size", np.int64),  # points of a layer
        ("divisions", np.int64),  # of its grid
        ("states", np.int64),  # of the model
        ("lifts", np.int64),  # 1: what the mood adds to the reward is added
    ]
)


class Index(NamedTuple):
    """B functions for M models of S states.

    Attributes:
        worth: (B, M, S) value in each state, where a function is linear.
        place: (B, M) of PLACE.
        steps: see `grid.steps`.
        values: of all layers.
    """

    worth: Floats
    place: NDArray[np.void]
    steps: Ints
    values: Floats


def linear(worth: Floats) -> Index:
    """Return the function that is worth (M, S) in the states."""
    place = np.zeros((1, len(worth)), dtype=PLACE)
    place["layer"] = LINEAR
    worth = np.ascontiguousarray(worth[None])
    return Index(worth, place, grid.steps(2, 1), np.empty(0))


def by_rest(models: int, states: int) -> Index:
    """Return the number of slots that an item has rested."""
    place = np.zeros((1, models), dtype=PLACE)
    place["layer"] = BY_REST
    return Index(np.zeros((1, models, states)), place, grid.steps(2, 1), np.empty(0))


def tabled(layers: Layers, states: int) -> Index:
    """Return the function that the first layers hold, for beliefs of S states."""
    place = np.zeros((1, len(layers.states)), dtype=PLACE)
    place["start"], place["size"] = layers.start, layers.size
    place["divisions"], place["states"] = layers.divisions, layers.states
    worth = np.zeros((1, len(layers.states), states))
    return Index(worth, place, layers.steps, layers.values)


def by_mood(index: Index) -> Index:
    """Return functions to which it is added what the mood adds to the reward.

    `value_of` leaves that to its callers, who know the mood.
    """
    place = index.place.copy()
    place["lifts"] = 1
    return index._replace(place=place)


def together(parts: Sequence[Index]) -> Index:
    """Stack functions of the same models."""
    places = [part.place.copy() for part in parts]
    start = 0
    for place, part in zip(places, parts, strict=True):
        place["start"] += start
        start += len(part.values)
    return Index(
        np.concatenate([part.worth for part in parts]),
        np.concatenate(places),
        grid.steps(
            max(len(part.steps) for part in parts),
            max(part.steps.shape[1] for part in parts) - 2,
        ),
        np.concatenate([part.values for part in parts]),
    )


@inner
def value_of(
    index: Index,
    b: int,
    m: int,
    belief: Floats,
    row: int,
    rested: float,
    corners: grid.Corners,
) -> float:
    """Return function b of an item of model m, by belief[row] and its slots of rest.

    `corners` is scratch.
    """
    layer = index.place[b, m].layer
    value = 0.0
    if layer == LINEAR:
        for i in range(belief.shape[1]):
            value += belief[row, i] * index.worth[b, m, i]
        return value
    if layer == BY_REST:
        return rested
    states, size = index.place[b, m].states, index.place[b, m].size
    divisions = index.place[b, m].divisions
    grid.locate(index.steps, states, divisions, belief, row, corners)
    start = index.place[b, m].start + layer * size
    value = grid.interpolated(index.values, start, states, corners)
    blend = index.place[b, m].blend
    if blend > 0.0:
        above = grid.interpolated(index.values, start + size, states, corners)
        value += blend * (above - value)
    return value


@compiled
def values(index: Index, b: int, model: Ints, belief: Floats) -> Floats:
    """Return (G,): function b of items of model (G,) and belief (G, S)."""
    corners = grid.corners(belief.shape[1])
    found = np.empty(len(model))
    for g in range(len(model)):
        found[g] = value_of(index, b, model[g], belief, g, 0.0, corners)
    return found
