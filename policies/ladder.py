"""Where an advantage, known at the subsidies of a ladder, changes its sign."""

import numpy as np
from numpy.typing import NDArray

from policies.arrays import Floats
from policies.compiled import compiled, inner

NOISE = 1e-6  # an advantage below this is none


@compiled
def sign_changes(
    ladder: Floats, advantage: Floats
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Say where resting becomes best, and whether playing does again.

    Args:
        ladder: (L,) subsidies, evenly spread.
        advantage: (L, P) of playing over resting, at P points.

    Returns:
        (P,): the first subsidy at which the advantage is zero, or the first or last one
        of all; (P,): by how much that may be wrong if the advantage bends more often
        than it can be seen to; and (P,): whether there is an advantage at a rung after.
    """
    points = advantage.shape[1]
    found, doubt = np.full(points, ladder[-1]), np.zeros(points)
    again = np.zeros(points, dtype=np.bool_)
    for point in range(points):
        rung = 0
        while rung < len(ladder) and advantage[rung, point] > 0.0:
            rung += 1
        if rung < len(ladder):
            found[point], doubt[point] = _between(ladder, advantage, rung, point)
        for later in range(rung + 1, len(ladder)):
            again[point] |= advantage[later, point] > NOISE
    return found, doubt, again


@inner
def _between(
    ladder: Floats, advantage: Floats, rung: int, point: int
) -> tuple[float, float]:
    """Return where the advantage is zero, between a rung and the one before it.

    It bends there if rests lead back to the point: from its index on, they go on for
    ever. So it is prolonged from both sides, and drawn across; with one bend, wherever
    that is, the middle one of the three lines is exact. How far they are apart is
    returned, too.
    """
    if rung == 0:
        return float(ladder[0]), 0.0
    across = _zero(ladder, advantage, rung - 1, point)
    left, right = across, across
    if rung > 1 and advantage[rung - 2, point] > advantage[rung - 1, point]:
        left = _zero(ladder, advantage, rung - 2, point)
    if rung + 1 < len(ladder) and advantage[rung, point] > advantage[rung + 1, point]:
        right = _zero(ladder, advantage, rung, point)
    middle = max(min(left, right), min(max(left, right), across))
    apart = max(left, right, across) - min(left, right, across)
    return float(min(max(middle, ladder[rung - 1]), ladder[rung])), float(apart)


@inner
def _zero(ladder: Floats, advantage: Floats, rung: int, point: int) -> float:
    """Return where the line through a rung and the next one is zero."""
    here = advantage[rung, point]
    fall = here - advantage[rung + 1, point]
    return float(ladder[rung] + (ladder[1] - ladder[0]) * here / fall)
