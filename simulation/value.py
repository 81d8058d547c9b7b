"""What policies earn on average, estimated by simulating the belief process.

All policies meet the same listeners and the same random numbers: differences between
them are paired.
"""

import os
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import numpy as np

from policies import Floats, Situation
from simulation.contender import Contender, Progress
from simulation.course import Course
from simulation.listeners import Listeners
from simulation.playing import decision_time, played
from simulation.runs import MOST_ROWS, Earned, nothing, rows_of

NORMAL = 1.959964  # standard errors on either side of a mean, for 95 %
FEW = (12.706, 4.303, 3.182, 2.776)  # the same of few values, by degrees of freedom
AHEAD = 16  # parts of the runs that wait for a thread


@dataclass(frozen=True, slots=True, eq=False)
class Value:
    """What a policy earned in R runs.

    Attributes:
        rewards: (R,) discounted.
        difference: (R,) to the first policy.
        curve: (T,) mean of what was earned by the end of each slot.
        curve_error: (T,) standard error of that mean.
        shares: (G,) share of all plays that each group of the start had.
        decision_us: median time of a decision, in microseconds.
    """

    rewards: Floats
    difference: Floats
    curve: Floats
    curve_error: Floats
    shares: Floats
    decision_us: float

    @property
    def mean(self) -> float:
        """Mean of the rewards."""
        return float(self.rewards.mean())

    @property
    def error(self) -> float:
        """Standard error of that mean."""
        return standard_error(self.rewards)


def standard_error(values: Floats) -> float:
    """Return the standard error of the mean of (R,) independent values."""
    return float(values.std(ddof=1) / np.sqrt(len(values)))


def half_width(values: Floats) -> float:
    """Return half the width of a 95 % interval of the mean, by Student's t."""
    return quantile(len(values) - 1) * standard_error(values)


def quantile(freedom: int) -> float:
    """Return how many standard errors are on either side of a mean, for 95 %.

    Of Student's t, by the expansion of Fisher and Cornish (1960) beyond a few degrees
    of freedom, where it is exact to three digits.
    """
    if freedom <= len(FEW):
        return FEW[freedom - 1]
    z = NORMAL
    first = (z**3 + z) / 4
    second = (5 * z**5 + 16 * z**3 + 3 * z) / 96
    third = (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    return z + first / freedom + second / freedom**2 + third / freedom**3


def remainder(start: Situation, course: Course) -> float:
    """Return more than which no policy earns on average after the last slot."""
    most = float(start.models.most_like[start.model].max())
    return course.discount**course.slots / (1 - course.discount) * most


def value(
    contenders: Sequence[Contender],
    start: Situation,
    course: Course,
    listeners: Listeners | None = None,
    threads: int | None = None,
    progress: Progress = lambda _share: None,
) -> Sequence[Value]:
    """Try policies on the same runs.

    Args:
        contenders: policies, ready for the models of `start`.
        start: of every run; one item is played in a slot.
        course: of the runs.
        listeners: None: those of whom it is true what is believed at the start.
        threads: that work at a time, None: as many as processors. The results are the
            same, to the bit, but for times.
        progress: told the share of the work that is done, from 0 to 1.

    Returns:
        The value of each policy, in order.

    Raises:
        ValueError: there are no items, or several are to be played in a slot; or the
            listeners do not answer to the items.
    """
    if len(start.model) == 0 or start.slate.plays != 1:
        raise ValueError("start: must hold items, of which one is played in a slot")
    listeners = listeners or Listeners.believed(start)
    values: list[Value] = []
    for number, contender in enumerate(contenders):
        microseconds = decision_time(contender, start, listeners, course)
        whole, done = nothing(start, course.runs, course.slots), 0
        with closing(_in_threads(contender, start, listeners, course, threads)) as work:
            for earned in work:
                _add(whole, earned, done)
                done += len(earned.reward)
                progress((number + done / course.runs) / len(contenders))
        first = values[0].rewards if values else whole.reward
        values.append(_value(whole, first, microseconds))
    return values


def _add(whole: Earned, earned: Earned, first: int) -> None:
    """Add what runs have earned, from number `first` on."""
    whole.reward[first : first + len(earned.reward)] = earned.reward
    whole.plays[:] += earned.plays
    whole.total[:] += earned.total
    whole.squares[:] += earned.squares


def _value(whole: Earned, first: Floats, microseconds: float) -> Value:
    runs = len(whole.reward)
    curve = whole.total / runs
    spread = np.maximum(whole.squares / runs - curve**2, 0) / (runs - 1)
    return Value(
        whole.reward,
        whole.reward - first,
        curve,
        np.sqrt(spread),
        whole.plays / whole.plays.sum(),
        microseconds,
    )


def _in_threads(
    contender: Contender,
    start: Situation,
    listeners: Listeners,
    course: Course,
    threads: int | None,
) -> Generator[Earned, None, None]:
    """Yield what runs have earned, in order.

    Ends early, if it is closed, with the runs that have begun.
    """
    rows = rows_of(start, course.slots)
    size = max(MOST_ROWS // rows, 1) if contender.at_once else 1
    end = course.first + course.runs
    work = partial(played, contender, start, listeners, course)
    threads = threads or os.cpu_count() or 1
    executor, waiting = ThreadPoolExecutor(threads), deque[Future[Earned]]()
    try:
        for first in range(course.first, end, size):
            waiting.append(executor.submit(work, first, min(size, end - first)))
            if len(waiting) > AHEAD * threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        executor.shutdown(cancel_futures=True)
