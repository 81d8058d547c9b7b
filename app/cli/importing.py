"""`encore import`: reads models, items or a history from a file, all or nothing."""

from collections.abc import Callable, Coroutine
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from app.api.schemas.lines import HISTORY, ITEMS, MODELS
from app.cli.console import AsJson, Failed, note, progress, say, show_json
from app.cli.files import opened
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.errors import InvalidImport
from app.services.changes import Imported
from app.services.formats import Format
from app.services.histories import HistoryImported, import_history
from app.services.imports import import_items
from app.services.model_imports import import_models

Result = Imported | HistoryImported
BY = "command line"
HINTS = {
    "model": "Import models first.",
    "item": "Import items first.",
    "signal": "With --any-signal they are entered all the same, and count as none.",
}

File = Annotated[Path, typer.Argument(help="What to read; - is the standard input.")]
FormatOption = Annotated[
    Format | None,
    typer.Option("--format", help="Left out: as the name of the file ends."),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Check, change nothing.")]

command = typer.Typer(no_args_is_help=True)


@command.command()
def models(
    file: File,
    *,
    format_: FormatOption = None,
    dry_run: DryRun = False,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Create and replace models."""
    with opened(file, format_, MODELS) as lines:

        async def task(session: Session) -> Result:
            return await import_models(session.database, lines, by=BY, dry_run=dry_run)

        _run(task, database_url, dry_run=dry_run, as_json=as_json)


@command.command()
def items(
    file: File,
    *,
    format_: FormatOption = None,
    dry_run: DryRun = False,
    retire_missing: Annotated[
        bool,
        typer.Option(
            "--retire-missing", help="Retire items that the file does not name."
        ),
    ] = False,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Create and replace items."""
    with opened(file, format_, ITEMS) as lines:

        async def task(session: Session) -> Result:
            return await import_items(
                session.database,
                session.live,
                lines,
                by=BY,
                dry_run=dry_run,
                retire_missing=retire_missing,
            )

        _run(task, database_url, dry_run=dry_run, as_json=as_json)


@command.command()
def history(
    file: File,
    *,
    format_: FormatOption = None,
    any_signal: Annotated[
        bool,
        typer.Option(
            "--any-signal",
            help="Take signals that an item's model lacks: they count as none.",
        ),
    ] = False,
    dry_run: DryRun = False,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Enter plays that users made before; those entered earlier are left out."""
    with opened(file, format_, HISTORY) as lines, progress() as bar:
        line = bar.add_task("plays", total=None)

        async def task(session: Session) -> Result:
            return await import_history(
                session.database,
                session.live,
                session.settings,
                lines,
                any_signal=any_signal,
                dry_run=dry_run,
                progress=lambda done, of: bar.update(line, completed=done, total=of),
            )

        _run(task, database_url, dry_run=dry_run, as_json=as_json)


def _run(
    task: Callable[[Session], Coroutine[None, None, Result]],
    database_url: str | None,
    *,
    dry_run: bool,
    as_json: bool,
) -> None:
    try:
        result = perform(configured(database_url=database_url), task)
    except InvalidImport as error:
        raise refused(error) from error
    if isinstance(result, Imported):
        for model, warnings in result.warnings.items():
            for warning in warnings:
                note(f"Warning: model {model!r}: {warning}")
    if as_json:
        show_json(asdict(result))
    else:
        say(_described(result, dry_run=dry_run))


def refused(error: InvalidImport) -> Failed:
    """Name the lines in error, each in a line."""
    for fault in error.faults:
        note(f"{fault.field}: {fault.message}")
    return Failed(error.detail + _hint(error))


def _hint(error: InvalidImport) -> str:
    """What to do if all that is wrong is that one kind of thing is not known."""
    for kind, hint in HINTS.items():
        told = [fault.message.startswith(f"unknown {kind} ") for fault in error.faults]
        if told and all(told):
            return f" {hint}"
    return ""


def _described(result: Result, *, dry_run: bool) -> str:
    if isinstance(result, HistoryImported):
        if dry_run:
            return f"every line is good, users {result.users} (nothing was changed)"
        return f"users {result.users}, entered {result.entered}, known {result.known}"
    if dry_run:
        return (
            f"would create {result.created}, replace {result.replaced},"
            f" leave {result.unchanged}, retire {result.retired}"
            " (nothing was changed)"
        )
    return (
        f"created {result.created}, replaced {result.replaced},"
        f" unchanged {result.unchanged}, retired {result.retired}"
    )
