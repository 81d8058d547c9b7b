"""Policies tried while somebody watches: one trial at a time, in a thread of its own.

A trial depends on nothing but what was asked for and, if that is what it is about, on
the catalogue: whoever loses the connection asks again, of this process or another one.
"""

import asyncio
import math
import time
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from functools import partial
from typing import NamedTuple

from app.domain import Described
from app.errors import (
    Fault,
    InvalidRequest,
    NotReady,
    SimulatorBusy,
    TooLargeToBound,
    TooLongToSimulate,
)
from app.services import bounds, entrants, index_tables, openings, trials
from app.services.catalogue import Catalogue
from app.services.entrants import Entrant
from app.services.live import Live
from app.services.niceness import give_way
from app.services.openings import Opening
from app.services.policy_catalogue import checked
from app.services.trials import Setting, Start, Trial
from app.storage import revision
from app.storage.database import Database
from app.storage.store import Store
from policies import Floats, Tables
from simulation import table_discounts
from simulation.examples import IN_STATES, NUMBERS

EVERY = 0.2  # seconds between two words on how far it is
POINTS = 300  # of a curve at most
UNBOUNDED = "Users who begin in given states are not those that are believed in."


class Stage(StrEnum):
    """What is being done: a bound is sought, tables are built, users are simulated."""

    BOUND = "bound"
    TABLES = "tables"
    USERS = "users"


class Step(NamedTuple):
    """How far it is."""

    stage: Stage
    share: float


@dataclass(frozen=True, slots=True)
class Wanted:
    """What to try.

    example:  of the paper; None: the catalogue as it is, and before the others the
              policy in force
    policies: at the discount, unless their parameters say otherwise
    """

    example: int | None
    policies: Sequence[Described]
    start: Start
    runs: int
    slots: int | None
    discount: float
    seed: int
    depth: int


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """What came of it.

    reason: why there is no bound
    slots:  (P,) numbers, from 1, of those that curves show
    curves: (P,) of each policy: the mean of what was earned by the end of a slot
    errors: (P,) its standard error
    """

    trial: Trial
    reason: str | None
    slots: Sequence[int]
    curves: Sequence[Floats]
    errors: Sequence[Floats]


class Stopped(Exception):
    """Nobody waits for it any more."""


class Simulator:
    """Tries policies. `budget`: processor time that a trial may take, as foretold."""

    def __init__(self, database: Database, live: Live, budget: timedelta) -> None:
        self._database = database
        self._live = live
        self._budget = budget.total_seconds()
        self._thread = ThreadPoolExecutor(1, "simulation", give_way)
        self._watched: Watched | None = None

    async def begin(self, wanted: Wanted) -> AsyncIterator[Step | Simulated]:
        """Begin a trial; what comes of it is told last.

        Raises:
            InvalidRequest: it cannot be tried.
            TooLongToSimulate: it would take more than the budget.
            SimulatorBusy: another one goes on.
        """
        read = partial(_setting, live=self._live, wanted=wanted)
        setting = await self._database.run(read)
        self._check(setting, wanted)
        if self._watched is not None and not self._watched.is_done:
            raise SimulatorBusy("Another simulation goes on here; try again shortly.")
        self._watched = Watched(self._thread, partial(_perform, setting, wanted.depth))
        return self._watched.told()

    def stop(self) -> None:
        """Give up what goes on."""
        if self._watched is not None:
            self._watched.stop()
        self._thread.shutdown(wait=False)

    def _check(self, setting: Setting, wanted: Wanted) -> None:
        seconds = setting.processor_seconds
        if seconds <= self._budget:
            return
        course, models = setting.course, len(setting.opening.models)
        runs = math.floor(course.runs * self._budget / seconds)
        field, told = ("runs", f"about {runs}") if runs > 1 else ("slots", "fewer")
        raise TooLongToSimulate(
            f"This would take about {seconds:.3g} s ({models} models, {course.runs}"
            f" runs of {course.slots} slots), and {self._budget:g} s are allowed here;"
            " `encore simulate` takes any time.",
            Fault(field, f"{told} would do", getattr(wanted, field)),
        )


class Watched:
    """Work in a thread, which says how far it is."""

    def __init__(
        self,
        thread: ThreadPoolExecutor,
        work: Callable[[Callable[[Stage, float], None]], Simulated],
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._steps = asyncio.Queue[Step | None]()
        self._next = 0.0
        self._stopped = False
        self._done: Future[Simulated] = thread.submit(work, self._tell)
        self._done.add_done_callback(lambda _done: self._put(None))

    @property
    def is_done(self) -> bool:
        return self._done.done()

    def stop(self) -> None:
        self._stopped = True

    async def told(self) -> AsyncIterator[Step | Simulated]:
        try:
            while (step := await self._steps.get()) is not None:
                yield step
            simulated: Simulated = await asyncio.wrap_future(self._done)
            yield simulated
        finally:
            self.stop()

    def _tell(self, stage: Stage, share: float) -> None:
        """Called in the thread."""
        if self._stopped:
            raise Stopped
        if (now := time.monotonic()) >= self._next:
            self._next = now + EVERY
            self._put(Step(stage, share))

    def _put(self, step: Step | None) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._steps.put_nowait, step)


def _setting(store: Store, live: Live, wanted: Wanted) -> Setting:
    try:
        course = trials.course(wanted.runs, wanted.slots, wanted.discount, wanted.seed)
    except ValueError as error:
        field, _, message = str(error).partition(": ")
        raise InvalidRequest(f"Wrong: {field}.", Fault(field, message)) from error
    states = _states(wanted)
    for number, policy in enumerate(wanted.policies):
        checked(policy, f"policies.{number}.")
    tried: Sequence[Entrant] = [
        entrants.entrant(policy.name, policy.params, wanted.discount)
        for policy in wanted.policies
    ]
    if wanted.example is not None:
        opening = openings.of_example(wanted.example, wanted.seed)
        return Setting(tried, opening, course, states)
    catalogue = live.catalogue(store, revision.current(store))
    opening = store.in_turn(partial(openings.of_catalogue, catalogue))
    tried = entrants.with_the_one_in_force(store, tried)
    tables = {
        discount: found
        for discount in table_discounts([each.policy for each in tried])
        if (found := _tables(store, live, catalogue, opening, discount)) is not None
    }
    return Setting(
        tried, opening, course, tables=tables, most_points=index_tables.ROUGH_POINTS
    )


def _tables(
    store: Store, live: Live, catalogue: Catalogue, opening: Opening, discount: float
) -> Tables | None:
    """Those in use, if there are any: rough ones are soon built."""
    try:
        found = live.tables(store, catalogue, discount)
    except NotReady:
        return None
    used = set(opening.models)
    return Tables.of(
        [table for key, table in found.items() if key.model in used], discount
    )


def _states(wanted: Wanted) -> Sequence[int] | None:
    if wanted.start is Start.BELIEF:
        return None
    if wanted.example not in NUMBERS:
        told = ", ".join(map(str, NUMBERS))
        fault = Fault("start", f"only the examples {told} have states", wanted.start)
        raise InvalidRequest("Users do not begin in states here.", fault)
    return IN_STATES


def _perform(
    setting: Setting, depth: int, tell: Callable[[Stage, float], None]
) -> Simulated:
    tell(Stage.BOUND, 0.0)
    most, reason = None, None
    if not setting.is_bounded:
        reason = bounds.MOODY if setting.opening.is_moody else UNBOUNDED
    else:
        limits = bounds.OF_A_REQUEST
        try:
            most = bounds.certified(
                setting.opening, setting.course.discount, depth, limits
            )
        except TooLargeToBound as error:
            reason = error.detail
    ready = trials.prepared(setting, partial(tell, Stage.TABLES))
    values = trials.tried(setting, ready, partial(tell, Stage.USERS), threads=1)
    slots = _some(setting.course.slots)
    places = [slot - 1 for slot in slots]
    return Simulated(
        trials.reported(setting, depth, most, values),
        reason,
        slots,
        [value.curve[places] for value in values],
        [value.curve_error[places] for value in values],
    )


def _some(slots: int) -> Sequence[int]:
    """At most so many of these slots, alike far apart, with the last one."""
    step = math.ceil(slots / POINTS)
    return [*range(slots, 0, -step)][::-1]
