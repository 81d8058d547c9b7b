"""Policies tried on simulated users of a catalogue, each of whom is new to it."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from app.services.entrants import Entrant
from app.services.openings import Opening
from policies import MOST_DISCOUNT, MOST_POINTS, Bound, Policy, Tables
from simulation import (
    Contender,
    Course,
    Listeners,
    Progress,
    Value,
    contenders,
    half_width,
    remainder,
    seconds,
    slots_of,
    value,
)

TOGETHER = 0.5  # what another processor adds, of the first


class Start(StrEnum):
    """Where users begin: hidden states follow the beliefs, or are the paper's own."""

    BELIEF = "belief"
    STATE = "state"


class Score(StrEnum):
    """What a play earns: its reward as expected, or as answered."""

    EXPECTED = "expected"
    CLICKS = "clicks"


def course(
    runs: int, slots: int | None, discount: float, seed: int, first: int = 0
) -> Course:
    """As many slots as count at the discount, unless told.

    Raises:
        ValueError: names the field at fault.
    """
    if not 0 <= discount <= MOST_DISCOUNT:
        raise ValueError(f"discount: must be from 0 to {MOST_DISCOUNT}, not {discount}")
    length = slots_of(discount) if slots is None else slots
    return Course(runs, length, discount, seed, first)


@dataclass(frozen=True, slots=True)
class Setting:
    """Who plays what to whom.

    states:      of each group in which users begin; None: as is believed
    tables:      index tables that need not be built, by discount
    most_points: of the grids of others
    """

    entrants: Sequence[Entrant]
    opening: Opening
    course: Course
    states: Sequence[int] | None = None
    score: Score = Score.EXPECTED
    tables: Mapping[float, Tables] = field(default_factory=dict)
    most_points: int = MOST_POINTS

    @property
    def start(self) -> Start:
        return Start.BELIEF if self.states is None else Start.STATE

    @property
    def is_bounded(self) -> bool:
        """Whether there is a bound: beliefs are right, and no mood joins the items."""
        return self.states is None and not self.opening.is_moody

    @property
    def listeners(self) -> Listeners:
        situation, clicks = self.opening.situation, self.score is Score.CLICKS
        if self.states is None:
            return Listeners.believed(situation, clicks=clicks)
        return Listeners.in_states(situation, self.states, clicks=clicks)

    @property
    def policies(self) -> Sequence[Policy]:
        return [each.policy for each in self.entrants]

    @property
    def processor_seconds(self) -> float:
        """Roughly what a trial takes of one processor."""
        return seconds(
            self.policies,
            self.opening.situation,
            self.course,
            self.tables.keys(),
            self.most_points,
        )

    @property
    def expected_seconds(self) -> float:
        """Roughly what a trial takes of all processors."""
        return self.processor_seconds / (1 + TOGETHER * ((os.cpu_count() or 1) - 1))


@dataclass(frozen=True, slots=True)
class Tried:
    """What a policy earned, in discounted rewards.

    ci95:        half the width of a 95 % interval of the mean
    difference:  to the first policy, on the same random numbers
    gap:         from the mean up to the bound, if there is one
    play_shares: of all plays, by model
    """

    label: str
    name: str
    params: Mapping[str, object]
    mean: float
    ci95: float
    difference: float
    difference_ci95: float
    gap: float | None
    gap_percent: float | None
    play_shares: Sequence[float]
    decision_us: float


@dataclass(frozen=True, slots=True)
class Trial:
    """Policies, each tried on the same simulated users.

    first:     number of the first of the runs that the seed gives
    remainder: at most so much is earned on average after the last slot, and left out
    items:     by model, as play shares are
    bound:     what no policy exceeds on average, found at a price of rest; none where
               users do not begin as is believed, or have moods
    """

    start: Start
    score: Score
    discount: float
    runs: int
    slots: int
    seed: int
    first: int
    remainder: float
    models: Sequence[str]
    items: Sequence[int]
    depth: int
    bound: float | None
    price: float | None
    policies: Sequence[Tried]


def prepared(setting: Setting, progress: Progress) -> Sequence[Contender]:
    """Make policies ready, their code compiled."""
    start = setting.opening.situation
    ready = contenders(
        setting.policies, start.models, progress, setting.tables, setting.most_points
    )
    value(ready, start, replace(setting.course, runs=2, slots=1), setting.listeners)
    return ready


def tried(
    setting: Setting,
    ready: Sequence[Contender],
    progress: Progress,
    threads: int | None = None,
) -> Sequence[Value]:
    """What each policy earns. `threads`: as many as processors, unless told."""
    start, course = setting.opening.situation, setting.course
    return value(ready, start, course, setting.listeners, threads, progress)


def reported(
    setting: Setting, depth: int, most: Bound | None, values: Sequence[Value]
) -> Trial:
    """All of it, for programs."""
    opening, course = setting.opening, setting.course
    bound = None if most is None else most.value
    return Trial(
        start=setting.start,
        score=setting.score,
        discount=course.discount,
        runs=course.runs,
        slots=course.slots,
        seed=course.seed,
        first=course.first,
        remainder=remainder(opening.situation, course),
        models=opening.models,
        items=opening.items,
        depth=depth,
        bound=bound,
        price=None if most is None else most.price,
        policies=[
            _tried(entrant, value, bound)
            for entrant, value in zip(setting.entrants, values, strict=True)
        ],
    )


def _tried(entrant: Entrant, value: Value, bound: float | None) -> Tried:
    gap = None if bound is None else bound - value.mean
    return Tried(
        label=entrant.label,
        name=entrant.name,
        params=entrant.params,
        mean=value.mean,
        ci95=half_width(value.rewards),
        difference=float(value.difference.mean()),
        difference_ci95=half_width(value.difference),
        gap=gap,
        gap_percent=100 * gap / bound if bound and gap is not None else None,
        play_shares=value.shares.tolist(),
        decision_us=value.decision_us,
    )
