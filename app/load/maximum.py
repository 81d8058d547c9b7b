"""How many requests a second a service can answer: found in steps."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from app.load.drive import Pace
from app.load.tally import Tally

STEPS = 12
DOWN = 0.95
LAG = 0.05  # part of a step by which the last answer may come late

Drive = Callable[[Pace], Tally]


@dataclass(frozen=True, slots=True)
class Tried:
    """A rate that was tried; None: as fast as was answered."""

    rate: float | None
    answered: float
    failed: int
    p99_ms: float
    sustained: bool


def steps(drive: Drive, pace: Pace) -> Iterator[Tried]:
    """Ask as fast as is answered, then by the clock, less and less, until it keeps up.

    Nothing is told of the first step: in it caches fill and connections open.
    """
    drive(Pace(None, pace.seconds / 3))
    first = _tried(drive(Pace(None, pace.seconds)), None, pace.seconds)
    yield first
    rate = first.answered
    for _ in range(STEPS if first.answered else 0):
        found = drive(Pace(rate, pace.seconds, pace.even))
        tried = _tried(found, rate, pace.seconds)
        yield tried
        if tried.sustained:
            return
        rate *= DOWN


def _tried(found: Tally, rate: float | None, seconds: float) -> Tried:
    in_time = found.seconds <= seconds * (1 + LAG)
    return Tried(
        rate,
        found.rate,
        found.failed,
        max((times.at(99) for times in found.latency.values()), default=0.0),
        sustained=rate is not None and in_time and not found.failed,
    )
