"""`encore audit`: whether what is believed is what the log of plays says."""

from dataclasses import asdict, dataclass, field

import typer

from app.cli.console import AsJson, progress, say, show_json, show_table
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.services.audits import Finding, audit


@dataclass(slots=True)
class Report:
    """What an audit found. `stale`: users whose beliefs are of earlier models."""

    users: int = 0
    plays: int = 0
    stale: int = 0
    findings: list[Finding] = field(default_factory=list)


def command(*, database_url: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """Compute all beliefs anew from the log of plays, and compare.

    Ends with 1 if anything is wrong; `encore rebuild` mends it.
    """
    report = perform(configured(database_url=database_url), _audited)
    if as_json:
        show_json(asdict(report))
    else:
        _show(report)
    if report.findings:
        raise typer.Exit(1)


async def _audited(session: Session) -> Report:
    report = Report()
    with progress() as bar:
        task = bar.add_task("users", total=None)
        async for audited in audit(session.database, session.live):
            report.users += 1
            report.plays += audited.plays
            report.stale += audited.stale
            report.findings += audited.findings
            bar.advance(task)
    return report


def _show(report: Report) -> None:
    if report.findings:
        rows = [(finding.user, finding.problem) for finding in report.findings]
        show_table(("user", "what is wrong"), rows)
    say(
        f"{report.users} users, {report.plays} plays, {report.stale} users to be"
        f" rebuilt when next seen, {len(report.findings)} faults"
    )
