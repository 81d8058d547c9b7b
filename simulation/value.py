"""What policies earn on average, estimated by simulating the belief process.

The state of an item is hidden, and what a policy sees of it is the belief: if the
hidden state at the start follows the belief, signals follow it ever after. So no hidden
state is drawn: a play earns its expected reward r(pi), and its signal is drawn from
what is believed. That has the mean of counted likes at a fraction of their variance
(Rao and Blackwell). All policies meet the same random numbers, so that differences
between them vary less still.
"""

import os
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import numpy as np

from policies import Floats, Situation
from simulation.contender import Contender
from simulation.course import Course
from simulation.playing import decision_time, played
from simulation.runs import Earned, rows_of

MOST_ROWS = 2**14  # of the runs that go on in step: they fit into a processor's cache


@dataclass(frozen=True, slots=True, eq=False)
class Value:
    """What a policy earned in R runs.

    Attributes:
        rewards: (R,) discounted, expected at each play from what was believed.
        difference: (R,) to the first policy.
        shares: (G,) share of all plays that each group of the start had.
        decision_us: median time of a decision, in microseconds.
    """

    rewards: Floats
    difference: Floats
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


def remainder(start: Situation, course: Course) -> float:
    """Return more than which no policy earns on average after the last slot."""
    most = float(start.models.like[start.model].max())
    return course.discount**course.slots / (1 - course.discount) * most


def value(
    contenders: Sequence[Contender],
    start: Situation,
    course: Course,
    threads: int | None = None,
    progress: Callable[[float], object] = lambda _share: None,
) -> Sequence[Value]:
    """Try policies on the same runs.

    Args:
        contenders: policies, ready for the models of `start`.
        start: of every run; one item is played in a slot.
        course: of the runs.
        threads: that work at a time, None: as many as processors. The results are the
            same, to the bit, but for times.
        progress: told the share of the work that is done, from 0 to 1.

    Returns:
        The value of each policy, in order.

    Raises:
        ValueError: there are no items, or several are to be played in a slot.
    """
    if len(start.model) == 0 or start.slate.plays != 1:
        raise ValueError("start: must hold items, of which one is played in a slot")
    values: list[Value] = []
    for number, contender in enumerate(contenders):
        microseconds = decision_time(contender, start, course)
        parts = []
        with closing(_in_threads(contender, start, course, threads)) as work:
            for done, earned in work:
                parts.append(earned)
                progress((number + done / course.runs) / len(contenders))
        rewards = np.concatenate([earned.reward for earned in parts])
        first = values[0].rewards if values else rewards
        plays = np.sum([earned.plays for earned in parts], axis=0)
        shares = plays / (course.runs * course.slots)
        values.append(Value(rewards, rewards - first, shares, microseconds))
    return values


def _in_threads(
    contender: Contender, start: Situation, course: Course, threads: int | None
) -> Generator[tuple[int, Earned], None, None]:
    """Yield how many runs are done, and what the latest of them earned, in order.

    Ends early, if it is closed, with the runs that have begun.
    """
    rows = rows_of(start, course.slots)
    size = max(MOST_ROWS // rows, 1) if contender.at_once else 1
    firsts = range(0, course.runs, size)
    sizes = [min(size, course.runs - first) for first in firsts]
    work = partial(played, contender, start, course)
    executor = ThreadPoolExecutor(threads or os.cpu_count())
    try:
        done = 0
        for earned in executor.map(work, firsts, sizes):
            done += len(earned.reward)
            yield done, earned
    finally:
        executor.shutdown(cancel_futures=True)
