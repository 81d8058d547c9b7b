"""What came of a load."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from app.load.times import Times

SHOWN = 20  # faults that are told in full, of each kind


class Step(StrEnum):
    """What a listener asks for. "Again": though it was answered before."""

    NEXT = "next"
    FEEDBACK = "feedback"
    NEXT_AGAIN = "next again"
    FEEDBACK_AGAIN = "feedback again"
    READ = "history"
    ERASE = "erase"


class Failure(NamedTuple):
    """An answer that is none. Status 0: nothing came back."""

    step: Step
    status: int
    code: str


class Fault(NamedTuple):
    """Something that the service promised, and did not keep."""

    code: str
    user: str
    detail: str


@dataclass(slots=True)
class Tally:
    """Counts and times; those of several processes add up.

    answered: answers with what was asked for
    backlog:  requests that were due at the end, and not yet sent
    seconds:  from the first request that was due to the last answer
    cpu:      seconds of processor time that sending and checking took
    latency:  from when a request was due to its answer
    late:     from when a request was due to when this program noticed
    queued:   from there to when a connection was free
    checked:  answers compared with what was due
    compared: plays in the users' histories compared with what was acknowledged
    open:     answers that were sent, and of which the service never said what came
    """

    answered: int = 0
    backlog: int = 0
    seconds: float = 0.0
    cpu: float = 0.0
    latency: dict[Step, Times] = field(default_factory=dict)
    late: Times = field(default_factory=Times)
    queued: Times = field(default_factory=Times)
    failures: Counter[Failure] = field(default_factory=Counter)
    checked: int = 0
    compared: int = 0
    open: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    shown: list[Fault] = field(default_factory=list)

    @property
    def failed(self) -> int:
        return self.failures.total()

    @property
    def rate(self) -> float:
        """Answers a second."""
        return self.answered / self.seconds if self.seconds else 0.0

    def took(self, step: Step, seconds: float) -> None:
        times = self.latency.get(step)
        if times is None:
            times = self.latency[step] = Times()
        times.add(seconds)
        self.answered += 1

    def note(self, faults: Iterable[Fault]) -> None:
        """Count faults, and keep the first of each kind."""
        for fault in faults:
            self.faults[fault.code] += 1
            if self.faults[fault.code] <= SHOWN:
                self.shown.append(fault)

    def merge(self, other: "Tally") -> None:
        """Add what another process counted in the same time."""
        self.answered += other.answered
        self.backlog += other.backlog
        self.seconds = max(self.seconds, other.seconds)
        self.cpu += other.cpu
        for step, times in other.latency.items():
            self.latency.setdefault(step, Times()).merge(times)
        self.late.merge(other.late)
        self.queued.merge(other.queued)
        self.failures.update(other.failures)
        self.take_checks(other)

    def take_checks(self, other: "Tally") -> None:
        """Add only what another one has compared, and found wrong."""
        self.checked += other.checked
        self.compared += other.compared
        self.open += other.open
        self.faults.update(other.faults)
        self.shown += other.shown
