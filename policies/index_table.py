"""Whittle's index of one model on a grid of beliefs, and how far it can be trusted.

A model is indexable if resting, once best, stays best as the subsidy rises: its
advantage then changes sign once, at the index (Whittle 1988). Here it is followed over
a ladder of subsidies, on ever finer grids, until the index has settled; where it bends
too often between two rungs, they are climbed again in small steps.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from policies import grid, subsidy
from policies.arrays import Floats, Ints
from policies.compiled import compiled
from policies.ladder import sign_changes
from policies.model_set import ModelSet

MOST_DISCOUNT = 0.999  # of tables that can be built; at more, values never settle
MOST_POINTS = 12_500
MOST_DIVISIONS = 2048
RUNGS = 201  # subsidies of the ladder for the index
STRIDE = 4  # every fourth of them is kept for values
FINER = 16  # rungs between two of them where an index is in doubt
MOST_VALUES = 2_000  # points of the grid on which values are kept
SETTLED = 1e-4  # the index may still move by this, in rewards, when a grid is finer
PRECISION = 1e-7  # of values, in rewards


@dataclass(frozen=True, slots=True, eq=False)
class IndexTable:
    """What is known of a model of S states at one discount.

    Attributes:
        states: S.
        discount: beta.
        divisions: M of the grid of the index.
        whittle: (P,) Whittle's index of each grid point.
        value_divisions: M of the grid of the values.
        value: (L, Q) V of each grid point at subsidies spread evenly from `low` to
            `high`; upper bounds.
        low: up to this subsidy playing is always best.
        high: from this subsidy resting is always best.
        reached: how many grid points lie around beliefs that the prior can lead to.
        unsettled: at how many of them playing becomes best again at a higher subsidy.
        unsettled_elsewhere: at how many other points it does; no belief gets there.
        error: how far the index of a point reached moved, at most, when the grid was
            last refined.
    """

    states: int
    discount: float
    divisions: int
    whittle: Floats
    value_divisions: int
    value: Floats
    low: float
    high: float
    reached: int
    unsettled: int
    unsettled_elsewhere: int
    error: float

    @property
    def indexable(self) -> bool:
        """Whether the model is, on the beliefs it has, as far as the grid can tell."""
        return self.unsettled == 0


def build(
    models: ModelSet,
    m: int,
    discount: float,
    most_points: int = MOST_POINTS,
    progress: Callable[[float], object] = lambda _share: None,
) -> IndexTable:
    """Compute the table of model m; about half a second for four states.

    Args:
        models: M models of S states.
        m: row of the model.
        discount: beta.
        most_points: size of the finest grid; 300 give a rough table at once.
        progress: told the share of the work that is done, from 0 to 1.

    Returns:
        The same table, to the bit, for the same arguments.
    """
    states = int(models.states[m])
    stages = divisions_of(states, most_points)
    ends = np.cumsum([grid.size(states, divisions) for divisions in stages])
    limits = subsidy.range_of(models, m, discount)
    fine, valued, error = UNKNOWN, UNKNOWN, math.inf
    for divisions, end in zip(stages, ends.tolist(), strict=True):
        coarse, done = fine, end - grid.size(states, divisions)
        advance = partial(_advance, progress, done / ends[-1], end / ends[-1])
        arm = subsidy.arm(models, m, divisions, discount)
        fine = _climbed(arm, divisions, limits, advance)
        if valued is UNKNOWN or len(fine.whittle) <= MOST_VALUES:
            valued = fine
        if coarse is not UNKNOWN:
            error = _moved(states, coarse, fine)
        if error <= SETTLED:
            break
    progress(1.0)
    return IndexTable(
        states,
        discount,
        fine.divisions,
        fine.whittle,
        valued.divisions,
        valued.value,
        *limits,
        reached=int(fine.reached.sum()),
        unsettled=int((fine.unsettled & fine.reached).sum()),
        unsettled_elsewhere=int((fine.unsettled & ~fine.reached).sum()),
        error=error,
    )


def divisions_of(states: int, most_points: int) -> list[int]:
    """Return the divisions of three nested grids, the finest of `most_points`.

    Of many states, some have more points even so; those are left out.
    """
    quarter = 1
    while (
        4 * (quarter + 1) <= MOST_DIVISIONS
        and grid.size(states, 4 * (quarter + 1)) <= most_points
    ):
        quarter += 1
    finer = (2 * quarter, 4 * quarter)
    return [quarter, *(d for d in finer if grid.size(states, d) <= most_points)]


class _Climbed(NamedTuple):
    """What a ladder of subsidies tells on one grid; see `IndexTable`."""

    divisions: int
    whittle: Floats
    value: Floats
    reached: NDArray[np.bool_]
    unsettled: NDArray[np.bool_]


NOWHERE = np.empty(0, dtype=np.bool_)
UNKNOWN = _Climbed(0, np.empty(0), np.empty((0, 0)), NOWHERE, NOWHERE)


def _climbed(
    arm: subsidy.Arm,
    divisions: int,
    limits: tuple[float, float],
    progress: Callable[[float], object],
) -> _Climbed:
    """Follow value and advantage over all rungs, each on the line of two before it."""
    ladder = np.linspace(*limits, RUNGS)
    value = before = arm.reward / (1 - arm.discount)
    advantage = np.empty((RUNGS, len(value)))
    values = []
    for rung, paid in enumerate(ladder):
        before, value = value, 2 * value - before
        subsidy.solve(arm, float(paid), value, advantage[rung], PRECISION)
        if rung % STRIDE == 0:
            values.append(value.copy())
        progress((rung + 1) / RUNGS)
    whittle, doubt, again = sign_changes(ladder, advantage)
    near = np.searchsorted(ladder, whittle)
    for rung in np.unique(near[arm.reached & (doubt > SETTLED)]).tolist():
        limits = ladder[rung - 1], ladder[rung]
        found = _climbed_again(arm, limits, values[(rung - 1) // STRIDE])
        inside = near[arm.reached] == rung
        whittle[np.flatnonzero(arm.reached)[inside]] = found[inside]
    return _Climbed(divisions, whittle, np.stack(values), arm.reached, again)


def _climbed_again(
    arm: subsidy.Arm, limits: tuple[float, float], value: Floats
) -> Floats:
    """Return the index of the points reached, where it lies within narrow limits."""
    alone, value = subsidy.on_reached(arm), value[arm.reached]
    low, high = limits
    step = (high - low) / FINER
    ladder = np.linspace(low - step, high + step, FINER + 3)
    advantage = np.empty((len(ladder), len(value)))
    for rung, paid in enumerate(ladder):
        subsidy.solve(alone, float(paid), value, advantage[rung], PRECISION)
    found, _, _ = sign_changes(ladder, advantage)
    return found


def _moved(states: int, coarse: _Climbed, fine: _Climbed) -> float:
    """Return by how much the index of the coarse grid's points moved, at most."""
    belief = grid.beliefs(states, coarse.divisions)[coarse.reached]
    steps = grid.steps(states, fine.divisions)
    now = _looked_up(steps, states, fine.divisions, belief, fine.whittle)
    return float(np.abs(now - coarse.whittle[coarse.reached]).max())


@compiled
def _looked_up(
    steps: Ints, states: int, divisions: int, belief: Floats, values: Floats
) -> Floats:
    corners = grid.corners(states)
    found = np.empty(len(belief))
    for row in range(len(belief)):
        grid.locate(steps, states, divisions, belief, row, corners)
        found[row] = grid.interpolated(values, 0, states, corners)
    return found


def _advance(
    progress: Callable[[float], object], start: float, end: float, share: float
) -> None:
    progress(start + share * (end - start))
