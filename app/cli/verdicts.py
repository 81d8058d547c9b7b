"""What a log says of other policies, for people."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from app.cli.console import note, say, show_table
from app.services.off_policies import Question, Verdict
from learning.off_policy.intervals import Estimate
from learning.off_policy.report import Answer, Refusal, Report

COLUMNS = ("choices", "a play earns", "more than the log", "worth")


def show(question: Question, verdicts: Sequence[Verdict]) -> None:
    """Print a table for each policy, and why what is missing is."""
    say(
        f"{len(question.plays)} plays, {int(question.catalogue.offered.sum())} items,"
        f" by {question.models}."
    )
    for verdict in verdicts:
        say()
        _show(verdict)


def _show(verdict: Verdict) -> None:
    label, report = verdict.entrant.label, verdict.report
    if report is None:
        note(f"{label}: the log cannot answer: {verdict.why}.")
        return
    say(
        f"{label}: by {report.answered} answered plays of {report.users} users, which"
        f" earned {_told(report.logged)} each; if the models are right, it earns"
        f" {_told(report.promised)}."
    )
    answers = [each for each in report.answers if isinstance(each, Answer)]
    if answers:
        show_table(COLUMNS, [_cells(each) for each in answers])
    for line in _refusals(report):
        note(line)


def _cells(each: Answer) -> Sequence[str]:
    return (
        f"{each.method} ({each.in_a_row})",
        _told(each.estimate),
        _told(each.gain, "+"),
        f"{each.effective:.0f}",
    )


def _refusals(report: Report) -> Iterator[str]:
    refused = (each for each in report.answers if isinstance(each, Refusal))
    for why, group in groupby(refused, key=lambda each: each.why):
        names = ", ".join(f"{each.method} ({each.in_a_row})" for each in group)
        yield f"No {names}: {why.detail} ({why.reason})."


def _told(estimate: Estimate, sign: str = "") -> str:
    mean, low, high = (
        format(value, f"{sign}.3f")
        for value in (estimate.mean, estimate.low, estimate.high)
    )
    return f"{mean} ({low} to {high})"
