"""What `encore bench` found, for people."""

from collections.abc import Iterator

from app.cli.console import note, say, show_table
from app.load.report import Outcome
from app.load.tally import Tally
from app.load.times import PERCENTILES, Times

COLUMNS = ("ms", "answers", *PERCENTILES, "max")
LATE = (
    "This program was late itself, by more than a tenth of a median: give it"
    " more processes or another machine, and trust no time above."
)


def show(outcome: Outcome) -> None:
    """Tell how fast it was, then whether it kept its promises."""
    for line in _rates(outcome):
        say(line)
    say()
    run = outcome.run
    rows = [(step.value, *_row(times)) for step, times in run.latency.items()]
    show_table(COLUMNS, [*rows, ("sent late", *_row(run.late))])
    say()
    for failure, count in run.failures.most_common():
        status = failure.status or "no answer"
        say(f"{failure.step} failed {count} times: {status}, {failure.code}")
    for line in _checks(outcome.checks):
        say(line)
    if outcome.is_late:
        note(LATE)


def _rates(outcome: Outcome) -> Iterator[str]:
    for tried in outcome.tried:
        how = "as fast as answered" if tried.rate is None else f"{tried.rate:.0f} asked"
        end = ", kept up" if tried.sustained else ""
        yield f"{tried.answered:.0f} answers a second, {how}{end}"
    run = outcome.run
    yield (
        f"{run.rate:.1f} answers a second for {run.seconds:.1f} s, asked"
        f" {outcome.wanted:.1f}: {run.answered} answers, {run.failed} failures"
    )


def _row(times: Times) -> tuple[str, ...]:
    found = times.described()
    columns = (*PERCENTILES, "max")
    return (str(len(times)), *(f"{found.get(name, 0):.2f}" for name in columns))


def _checks(checks: Tally) -> Iterator[str]:
    yield (
        f"{checks.checked} answers checked, {checks.compared} plays read back from"
        f" histories, {checks.open} of which nobody knows whether they were taken"
    )
    for code, count in checks.faults.most_common():
        yield f"{code}: {count}"
    for fault in checks.shown:
        yield f"  {fault.user}: {fault.code}: {fault.detail}"
