"""What trying policies will take."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from policies import MOST_POINTS, Policy, Situation
from simulation.contender import goes_at_once, table_discounts
from simulation.course import Course
from simulation.runs import MOST_ROWS, rows_of

TABLE = 0.5  # seconds to build the index table of a model on the finest grid
AROUND = 15.0  # microseconds beside each decision, of one run or of several
ROW = 0.1  # microseconds to score and move a group


def seconds(
    policies: Sequence[Policy],
    start: Situation,
    course: Course,
    at_hand: Collection[float] = (),
    most_points: int = MOST_POINTS,
) -> float:
    """Estimate the processor time of `contenders` and `value`, roughly.

    Args:
        policies: to be tried.
        start: of every run.
        course: of the runs.
        at_hand: discounts of which there are index tables.
        most_points: of the grids of others.
    """
    discounts = table_discounts(policies) - set(at_hand)
    each = TABLE * most_points / MOST_POINTS
    tables = each * len(discounts) * len(start.models.states)
    decisions = course.runs * course.slots
    moving = ROW * rows_of(start, course.slots)
    usual = _grown(start, course)
    together = max(MOST_ROWS // rows_of(start, course.slots), 1)
    deciding = sum(
        AROUND / together
        if goes_at_once(policy, start.models)
        else AROUND + policy.cost(usual)
        for policy in policies
    )
    return tables + decisions * (len(policies) * moving + deciding) / 1e6


def _grown(start: Situation, course: Course) -> Situation:
    """Return what a run comes to: the items that were played stand for themselves."""
    groups = np.arange(rows_of(start, course.slots)) % len(start.model)
    return replace(
        start,
        model=start.model[groups],
        belief=start.belief[groups],
        count=np.ones(len(groups), dtype=np.int64),
        rested=start.rested[groups],
    )
