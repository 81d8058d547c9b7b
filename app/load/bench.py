"""A whole run: find the maximum, ask at a rate, read back, erase."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager

from app.load.crew import Crew, Told
from app.load.drive import Pace
from app.load.maximum import Tried, steps
from app.load.plan import Plan, Wishes
from app.load.report import Outcome
from app.load.tally import Tally

STEP = 3.0  # seconds of a step on the way to the maximum

Watched = Callable[[str, float | None], AbstractContextManager[Told]]


class Unanswered(Exception):
    """The service answered nothing that could be measured."""


def run(plan: Plan, processes: int, wishes: Wishes, watched: Watched) -> Outcome:
    """Do all of it; `watched` shows how each part goes, and how much there is of it."""
    with Crew(plan, processes) as crew:
        bench = _Bench(crew, wishes, watched)
        tried = () if wishes.rate else bench.search()
        rate = wishes.rate or wishes.share * _best(tried)
        found = bench.drive("asking", Pace(rate, wishes.seconds, wishes.even))
        with watched("reading back", len(plan.users)) as told:
            bench.checks.merge(crew.read_back(told))
        outcome = Outcome(rate, tried, found, bench.checks)
        if plan.fresh and not wishes.keep and outcome.kept_promises:
            with watched("erasing", len(plan.users)) as told:
                crew.erase(told)
    return outcome


class _Bench:
    """The parts of a run. `checks`: all that was compared, and found wrong."""

    def __init__(self, crew: Crew, wishes: Wishes, watched: Watched) -> None:
        self.checks = Tally()
        self._crew = crew
        self._wishes = wishes
        self._watched = watched

    def search(self) -> Sequence[Tried]:
        """Find how many requests a second are answered in time."""
        pace = Pace(None, STEP, self._wishes.even)
        return [*steps(lambda pace: self.drive("finding the maximum", pace), pace)]

    def drive(self, name: str, pace: Pace) -> Tally:
        total = None if pace.rate is None else pace.rate * pace.seconds
        with self._watched(name, total) as told:
            found = self._crew.drive(pace, told)
        self.checks.take_checks(found)
        if not found.answered:
            raise Unanswered(", ".join(map(str, found.failures)) or "nothing was asked")
        return found


def _best(tried: Sequence[Tried]) -> float:
    """The rate that was kept up with, or the last one, that was not."""
    last = tried[-1]
    return last.rate or last.answered
