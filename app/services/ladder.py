"""A decision within its time: the best policy that is fast enough, and does not fail.

Policies stand on rungs, each cheaper than the one above. Which rung decides is chosen
before: the first that, as far as can be foretold, is done in time. One that then takes
too long is given up, one that fails is left to those who read the log; in both cases
the next rung decides. The rung is kept with the play: so it can be decided again.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

from app.errors import Overloaded
from app.services import slates
from app.services.decisions import Candidates, Decision
from app.services.pace import Pace
from app.services.rungs import Rung
from app.storage.aside import Late
from app.storage.store import Store
from policies import Policy

INLINE = 200e-6  # seconds; a longer decision is worth handing to a thread
LAST_RESORTS = 2  # rungs that are never too slow

Build = Callable[[Policy], Candidates]


class Cause(StrEnum):
    """Why a rung did not decide.

    SLOW:   it was foretold to take longer than there was time
    LATE:   it took longer
    FAILED: it raised an error
    """

    SLOW = "slow"
    LATE = "late"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, eq=False)
class Slip:
    """A rung that did not decide. `error`: what it raised."""

    rung: int
    cause: Cause
    error: Exception | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Decided:
    """Decisions for the places of one slot, all taken on one rung.

    slips: the rungs above it, and why they did not decide
    build: the candidates, as a policy looks at them
    """

    made: Sequence[Decision]
    rung: int
    slips: Sequence[Slip]
    build: Build


def decide(
    store: Store,
    rungs: Sequence[Rung],
    build: Build,
    seed: int,
    count: int,
    budget: float,
) -> Decided:
    """Choose up to `count` items on the first rung that has done so in time.

    build:  the candidates, as a policy looks at them
    budget: seconds
    """
    until = time.monotonic() + budget
    slips: list[Slip] = []
    for number, rung in enumerate(rungs):
        candidates = build(rung.policy)
        places = min(count, int(candidates.left.sum()))
        work = partial(slates.decide, candidates, rung, seed, places)
        try:
            if number >= len(rungs) - LAST_RESORTS:
                return Decided(work(), number, slips, build)
            cost = rung.policy.cost(candidates.situation) * places
            made = _in_time(store, rung.pace, cost, work, until)
        except (Late, Overloaded):
            slips.append(Slip(number, Cause.LATE))
        except Exception as error:
            if number == len(rungs) - 1:
                raise
            slips.append(Slip(number, Cause.FAILED, error))
        else:
            if made is not None:
                return Decided(made, number, slips, build)
            slips.append(Slip(number, Cause.SLOW))
    raise ValueError("there is no rung to decide on")


def _in_time(
    store: Store,
    pace: Pace,
    cost: float,
    work: Callable[[], Sequence[Decision]],
    until: float,
) -> Sequence[Decision] | None:
    """What was decided; None if that would take too long.

    Raises:
        Late: it has taken too long.
    """
    left = until - time.monotonic()
    foretold = pace.foretell(cost)
    is_short = foretold <= INLINE and pace.measured > 0
    if foretold + (0.0 if is_short else store.backlog) > left:
        return None
    timed = partial(_timed, pace, cost, work)
    if is_short:
        return timed()
    within = None if math.isinf(left) else left
    try:
        return store.aside(timed, within=within, foretold=foretold)
    except Late:
        pace.learn(cost, 2 * left)  # as far as is known by now
        raise


def _timed(
    pace: Pace, cost: float, work: Callable[[], Sequence[Decision]]
) -> Sequence[Decision]:
    began = time.perf_counter()
    made = work()
    pace.learn(cost, time.perf_counter() - began)
    return made
