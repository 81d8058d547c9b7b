"""A regular grid of beliefs, and interpolation between its points.

Lovejoy (1991), "Computationally feasible bounds for partially observed Markov decision
processes": the beliefs of S states whose parts are multiples of 1/M, cut into simplices
by Freudenthal's triangulation. Interpolating a convex function between the S corners of
a simplex never falls below it.

A belief is located by its tails x_i = M sum_{k >= i} pi(k). The points are ranked by
the number of lattice points before them, to which every coordinate adds on its own.
"""

from math import comb
from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner


class Corners(NamedTuple):
    """Room for the corners around one belief.

    Attributes:
        rank: (S,) ranks of the grid points around it.
        weight: (S,) its coordinates among them, of sum one.
        fraction: (S,) scratch.
        order: (S,) scratch.
    """

    rank: Ints
    weight: Floats
    fraction: Floats
    order: Ints


def size(states: int, divisions: int) -> int:
    """Return the number of points of a grid of S states and M divisions."""
    return comb(divisions + states - 1, states - 1)


def steps(states: int, divisions: int) -> Ints:
    """Return (S, M + 2): entry (q, x) is what a tail of x adds to a rank.

    Row q belongs to the tail that begins q states before the last one. The rows serve
    any model of up to S states, the columns any grid of up to M divisions.
    """
    return np.array(
        [
            [comb(tail + row, row + 1) for tail in range(divisions + 2)]
            for row in range(states)
        ],
        dtype=np.int64,
    )


@compiled
def corners(states: int) -> Corners:
    """Make room for the corners around a belief of S states."""
    return Corners(
        np.zeros(states, dtype=np.int64),
        np.zeros(states),
        np.zeros(states),
        np.zeros(states, dtype=np.int64),
    )


def beliefs(states: int, divisions: int) -> Floats:
    """Return (P, S): the beliefs of all grid points, by rank."""
    return _beliefs(steps(states, divisions), states, divisions)


@compiled
def _beliefs(steps: Ints, states: int, divisions: int) -> Floats:
    points = np.zeros((steps[states - 2, divisions + 1], states))
    tails = np.zeros(states + 1, dtype=np.int64)
    tails[0] = divisions
    for rank in range(len(points)):
        left = rank
        for i in range(1, states):  # the largest tail that does not pass the rank
            tails[i] = 0
            while steps[states - 1 - i, tails[i] + 1] <= left:
                tails[i] += 1
            left -= steps[states - 1 - i, tails[i]]
        for i in range(states):
            points[rank, i] = (tails[i] - tails[i + 1]) / divisions
    return points


@inner
def locate(
    steps: Ints,
    states: int,
    divisions: int,
    belief: Floats,
    row: int,
    corners: Corners,
) -> None:
    """Find the corners around belief[row], of which the first `states` count."""
    last = states - 1
    tail = 0.0
    rank = 0
    for i in range(last, 0, -1):
        tail += belief[row, i]
        scaled = min(tail, 1.0) * divisions
        whole = int(scaled)
        corners.fraction[i] = scaled - whole
        corners.rank[i] = whole
        rank += steps[last - i, whole]
        place = last - i  # the tails in order of their fractions, the largest first
        while place > 0 and corners.fraction[corners.order[place - 1]] < scaled - whole:
            corners.order[place] = corners.order[place - 1]
            place -= 1
        corners.order[place] = i
    before = 1.0
    for place in range(last):
        i = corners.order[place]
        whole = corners.rank[i]
        corners.weight[place] = before - corners.fraction[i]
        before = corners.fraction[i]
        corners.order[place] = (
            steps[last - i, whole + 1] - steps[last - i, whole] if before > 0.0 else 0
        )
    corners.weight[last] = before
    corners.rank[0] = rank
    for place in range(last):
        rank += corners.order[place]
        corners.rank[place + 1] = rank


@compiled
def find(
    steps: Ints,
    states: int,
    divisions: int,
    belief: Floats,
    row: int,
    corners: Corners,
) -> None:
    """Call `locate`, from Python."""
    locate(steps, states, divisions, belief, row, corners)


@inner
def interpolated(values: Floats, start: int, states: int, corners: Corners) -> float:
    """Return the value at a located belief, of a table that begins at `start`."""
    value = 0.0
    for place in range(states):
        value += corners.weight[place] * values[start + corners.rank[place]]
    return value
