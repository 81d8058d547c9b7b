"""`encore publish`: learned models go live, if they pass the gate."""

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress, TaskID

from app.api.schemas.lines import ITEMS, MODELS
from app.cli.console import AsJson, Failed, progress, say, show_json, show_table
from app.cli.files import opened
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.domain import Publication
from app.errors import InvalidImport
from app.services import candidates, publications
from app.services.audits import rebuild
from app.services.candidates import Candidate, NoCandidate
from app.services.gate import Judged, Terms, Verdict, judge
from app.services.logs import CannotLearn
from app.services.publications import GateClosed

BY = "command line"


@dataclass(frozen=True, slots=True)
class Asked:
    """What is to be done with a candidate."""

    candidate: Candidate
    terms: Terms
    note: str
    dry_run: bool
    rebuilds: bool


def command(
    folder: Annotated[Path, typer.Argument(help="What `encore fit` has written.")],
    *,
    margin: Annotated[
        float, typer.Option(min=0.0, help="Log loss that it may lose, in nats.")
    ] = Terms().margin,
    note: Annotated[str, typer.Option(help="Why, for the history.")] = "",
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Judge, change nothing.")
    ] = False,
    rebuild: Annotated[
        bool, typer.Option(help="Rebuild all beliefs now, not as users come.")
    ] = True,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Put learned models in force, if they foretell the service's plays no worse.

    They are judged by plays that they were not learned from, beside the models in force
    and a shrunk rate. POST /v1/admin/publications/rollback takes the last one back.
    """
    candidate = _read(folder)
    asked = Asked(candidate, Terms(margin=margin), note, dry_run, rebuild)
    task = partial(_performed, asked=asked)
    judged, published = perform(configured(database_url=database_url), task)
    if as_json:
        show_json(_told(judged.verdict, published))
    else:
        _show(judged.verdict, published)
    if not judged.verdict.passed:
        raise Failed("It does not pass the gate. Nothing was changed.")


def _read(folder: Path) -> Candidate:
    try:
        with (
            opened(folder / candidates.MODELS, None, MODELS) as models,
            opened(folder / candidates.ITEMS, None, ITEMS) as items,
        ):
            return candidates.read(folder, models, items)
    except NoCandidate as error:
        raise Failed(str(error), status=2) from error
    except InvalidImport as error:
        raise Failed(error.detail, status=2) from error


async def _performed(
    session: Session, asked: Asked
) -> tuple[Judged, Publication | None]:
    with progress() as bar:
        steps = bar.add_task("plays", total=None)
        judged = await _judged(session, asked, bar, steps)
        if asked.dry_run or not judged.verdict.passed:
            return judged, None
        publish = partial(
            publications.publish,
            live=session.live,
            candidate=asked.candidate,
            judged=judged,
            note=asked.note,
            by=BY,
        )
        try:
            published = await session.database.run_in_turn(publish)
        except GateClosed as error:
            raise Failed(str(error)) from error
        if asked.rebuilds:
            bar.update(steps, description="beliefs", completed=0)
            async for _ in rebuild(session.database, session.live, None):
                bar.advance(steps)
        return judged, published


async def _judged(
    session: Session, asked: Asked, bar: Progress, steps: TaskID
) -> Judged:
    try:
        return await judge(
            session.database,
            session.live,
            asked.candidate,
            asked.terms,
            lambda step: bar.update(steps, description=step),
        )
    except CannotLearn as error:
        raise Failed(f"It cannot be judged: {error}") from error


def _told(verdict: Verdict, published: Publication | None) -> object:
    number = None if published is None else published.number
    return {**verdict.plain(), "publication": number}


def _show(verdict: Verdict, published: Publication | None) -> None:
    show_table(
        ("check", "", "found"),
        [
            (check.name, "passed" if check.passed else "failed", check.detail)
            for check in verdict.checks
        ],
    )
    if published is not None:
        say()
        say(
            f"Publication {published.number}: models"
            f" {json.dumps(published.models)}, {published.items} items moved."
        )
