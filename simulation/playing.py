"""Playing runs by a policy, slot by slot."""

import statistics
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from policies import Floats, Mixture, ModelSet, Situation, as_floats, choose
from simulation.contender import Contender
from simulation.course import Course
from simulation.listeners import Listeners, Truth
from simulation.runs import (
    Earned,
    Runs,
    begin,
    decision_seed,
    nothing,
    play_slot,
    situation_of,
)

CERTAIN = np.ones(1)
TIMED = 500  # decisions at most


def played(
    contender: Contender,
    start: Situation,
    listeners: Listeners,
    course: Course,
    first: int,
    size: int,
) -> Earned:
    """Play runs from number `first` on, in step; one alone unless `at_once`."""
    truth = listeners.truth(start)
    runs = begin(start, listeners, first, size, course.slots)
    earned = nothing(start, size, course.slots)
    for slot in range(course.slots):
        seed = decision_seed(course.seed, first, slot)
        scored = contender.scorer(situation_of(start.models, runs), seed)
        _pass(start.models, truth, runs, scored, course, slot, earned)
    return earned


def decision_time(
    contender: Contender, start: Situation, listeners: Listeners, course: Course
) -> float:
    """Return the median microseconds of the first decisions of one run."""
    some = replace(course, slots=min(course.slots, TIMED))
    took = list(_times(contender, start, listeners, some))
    return statistics.median(took) * 1e6


def _times(
    contender: Contender, start: Situation, listeners: Listeners, course: Course
) -> Iterator[float]:
    truth = listeners.truth(start)
    runs = begin(start, listeners, course.first, 1, course.slots)
    earned = nothing(start, 1, course.slots)
    for slot in range(course.slots):
        seed = decision_seed(course.seed, course.first, slot)
        began = time.perf_counter()
        situation = situation_of(start.models, runs)
        scored = contender.scorer(situation, seed)
        choose(scored, situation.count, seed)
        yield time.perf_counter() - began
        _pass(start.models, truth, runs, scored, course, slot, earned)


def _pass(
    models: ModelSet,
    truth: Truth,
    runs: Runs,
    scored: Floats | Mixture,
    course: Course,
    slot: int,
    earned: Earned,
) -> None:
    weight, scores = scored if isinstance(scored, Mixture) else (CERTAIN, scored[None])
    worth = course.discount**slot
    play_slot(
        models,
        truth,
        runs,
        as_floats(weight),
        as_floats(scores),
        course.seed,
        slot,
        worth,
        earned,
    )
