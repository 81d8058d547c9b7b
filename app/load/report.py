"""What came of a load, as it is told."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from app.load.maximum import Tried
from app.load.tally import Tally

EARLY = 0.1  # part of the median latency that being late may make up


@dataclass(frozen=True, slots=True)
class Outcome:
    """A run at one rate, and how that was found.

    wanted:  requests a second
    tried:   steps on the way to the maximum, none if the rate was given
    run:     the run itself
    checks:  what is wrong with all answers, of the steps too, and the histories
    """

    wanted: float
    tried: Sequence[Tried]
    run: Tally
    checks: Tally

    @property
    def maximum(self) -> float | None:
        """Requests a second that were answered in time."""
        return next((one.rate for one in self.tried if one.sustained), None)

    @property
    def is_late(self) -> bool:
        """Whether this program was so late that its times say more of itself."""
        if not self.run.latency:
            return False
        median = min(times.at(50) for times in self.run.latency.values())
        return self.run.late.at(99) > EARLY * median

    @property
    def kept_promises(self) -> bool:
        return not self.checks.faults


def as_json(outcome: Outcome) -> Mapping[str, object]:
    """All of it, for programs; times in milliseconds."""
    run, checks = outcome.run, outcome.checks
    return {
        "rate": {"wanted": outcome.wanted, "answered": run.rate},
        "maximum": outcome.maximum,
        "steps": [asdict(one) for one in outcome.tried],
        "seconds": run.seconds,
        "answered": run.answered,
        "failed": run.failed,
        "failures": [
            {**failure._asdict(), "count": count}
            for failure, count in run.failures.most_common()
        ],
        "latency_ms": {
            step: {"count": len(times), **times.described()}
            for step, times in run.latency.items()
        },
        "late_ms": run.late.described(),
        "is_late": outcome.is_late,
        "queued_ms": run.queued.described(),
        "backlog": run.backlog,
        "cpu_seconds": run.cpu,
        "checks": {
            "answers": checks.checked,
            "histories": checks.compared,
            "open": checks.open,
            "faults": dict(checks.faults),
            "shown": [fault._asdict() for fault in checks.shown],
        },
        "histograms": {step: times.encoded() for step, times in run.latency.items()},
    }
