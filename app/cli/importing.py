"""`encore import`: reads models, items or a history from a file, all or nothing."""

import shutil
import sys
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Annotated, TypeVar

import typer

from app.api.schemas.lines import HISTORY, ITEMS, MODELS
from app.cli.console import AsJson, Failed, note, progress, say, show_json
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.errors import InvalidImport
from app.services.changes import Imported
from app.services.formats import Format
from app.services.histories import HistoryImported, import_history
from app.services.imports import import_items
from app.services.lines import Layout, LineFile
from app.services.model_imports import import_models

T = TypeVar("T")
Result = Imported | HistoryImported
BY = "command line"
FORMATS = {
    ".csv": Format.CSV,
    ".json": Format.JSON,
    ".jsonl": Format.NDJSON,
    ".ndjson": Format.NDJSON,
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
    with _opened(file, format_, MODELS) as lines:

        async def task(session: Session) -> Result:
            return await import_models(session.database, lines, by=BY, dry_run=dry_run)

        _run(task, database_url, as_json=as_json)


@command.command()
def items(
    file: File,
    *,
    format_: FormatOption = None,
    dry_run: DryRun = False,
    retire_missing: Annotated[
        bool, typer.Option(help="Retire items that the file does not name.")
    ] = False,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Create and replace items."""
    with _opened(file, format_, ITEMS) as lines:

        async def task(session: Session) -> Result:
            return await import_items(
                session.database,
                session.live,
                lines,
                by=BY,
                dry_run=dry_run,
                retire_missing=retire_missing,
            )

        _run(task, database_url, as_json=as_json)


@command.command()
def history(
    file: File,
    *,
    format_: FormatOption = None,
    dry_run: DryRun = False,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Enter plays that users made before; those entered earlier are left out."""
    with _opened(file, format_, HISTORY) as lines, progress() as bar:
        line = bar.add_task("plays", total=None)

        async def task(session: Session) -> Result:
            return await import_history(
                session.database,
                session.live,
                session.settings,
                lines,
                dry_run=dry_run,
                progress=lambda done, of: bar.update(line, completed=done, total=of),
            )

        _run(task, database_url, as_json=as_json)


@contextmanager
def _opened(
    file: Path, format_: Format | None, layout: Layout[T]
) -> Iterator[LineFile[T]]:
    """A file that can be read twice, as an import needs it."""
    named = format_ or FORMATS.get(file.suffix.lower())
    if file == Path("-"):
        with TemporaryFile() as kept:
            shutil.copyfileobj(sys.stdin.buffer, kept)
            yield LineFile(kept, format_ or Format.NDJSON, layout)
    elif named is None:
        endings = ", ".join(FORMATS)
        raise Failed(f"{file} does not end in {endings}: say its --format.", status=2)
    else:
        with _open(file) as found:
            yield LineFile(found, named, layout)


def _open(file: Path) -> IO[bytes]:
    try:
        return file.open("rb")
    except OSError as error:
        raise Failed(f"{file} cannot be read: {error.strerror}.", status=2) from error


def _run(
    task: Callable[[Session], Coroutine[None, None, Result]],
    database_url: str | None,
    *,
    as_json: bool,
) -> None:
    try:
        result = asdict(perform(configured(database_url=database_url), task))
    except InvalidImport as error:
        for fault in error.faults:
            note(f"{fault.field}: {fault.message}")
        raise Failed(error.detail) from error
    if as_json:
        show_json(result)
    else:
        say(", ".join(f"{name} {value}" for name, value in result.items()))
