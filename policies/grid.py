"""A regular grid of beliefs, and interpolation between its points.

Lovejoy (1991), "Computationally feasible bounds for partially observed Markov decision
processes": the beliefs of S states whose parts are multiples of 1/M, cut into simplices
by Freudenthal's triangulation. Interpolating a convex function between the S corners of
a simplex never falls below it.

A belief is located by its tails x_i = M sum_{k >= i} pi(k). The points are ranked by
the number of lattice points before them, to which every coordinate adds on its own.
"""

from math import comb
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner

CORNER = np.dtype(
    [
        ("rank", np.int64),  # of a grid point around the belief
        ("weight", np.float64),  # its coordinate among them; all add up to one
        ("fraction", np.float64),  # scratch
        ("order", np.int64),  # scratch
    ]
)
Corners: TypeAlias = NDArray[np.void]  # (S,) of CORNER
MOST = int(np.iinfo(np.int64).max)


def size(states: int, divisions: int) -> int:
    """Return the number of points of a grid of S states and M divisions."""
    return comb(divisions + states - 1, states - 1)


def steps(states: int, divisions: int) -> Ints:
    """Return (S, M + 2): entry (q, x) is what a tail of x adds to a rank.

    Row q belongs to the tail that begins q states before the last one. The rows serve
    any model of up to S states, the columns any grid of up to M divisions. What no grid
    that fits into memory needs may be too large for an integer; then it is the largest.
    """
    return np.array(
        [
            [min(comb(tail + row, row + 1), MOST) for tail in range(divisions + 2)]
            for row in range(states)
        ],
        dtype=np.int64,
    )


@compiled
def corners(states: int) -> Corners:
    """Make room for the corners around a belief of S states."""
    return np.zeros(states, dtype=CORNER)


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
        corners[i].fraction = scaled - whole
        corners[i].rank = whole
        rank += steps[last - i, whole]
        place = last - i  # the tails in order of their fractions, the largest first
        while place > 0 and corners[corners[place - 1].order].fraction < scaled - whole:
            corners[place].order = corners[place - 1].order
            place -= 1
        corners[place].order = i
    before = 1.0
    for place in range(last):
        i = corners[place].order
        whole = corners[i].rank
        corners[place].weight = before - corners[i].fraction
        before = corners[i].fraction
        corners[place].order = (
            steps[last - i, whole + 1] - steps[last - i, whole] if before > 0.0 else 0
        )
    corners[last].weight = before
    corners[0].rank = rank
    for place in range(last):
        rank += corners[place].order
        corners[place + 1].rank = rank


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
        value += corners[place].weight * values[start + corners[place].rank]
    return value
