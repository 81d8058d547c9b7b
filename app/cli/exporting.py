"""`encore export`: writes models, items or the history, to be imported again."""

import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Annotated

import typer

from app.cli.console import Failed, note, progress
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.services.exports import export_history, export_items, export_models
from app.storage.database import Database

Export = Callable[[Database], AsyncIterator[str]]
File = Annotated[
    Path | None, typer.Argument(help="NDJSON file to write; left out: standard output.")
]

command = typer.Typer(no_args_is_help=True)


@command.command()
def models(file: File = None, *, database_url: DatabaseUrl = None) -> None:
    """Write the latest version of each model."""
    _export(export_models, file, database_url)


@command.command()
def items(file: File = None, *, database_url: DatabaseUrl = None) -> None:
    """Write all items; retired ones say so."""
    _export(export_items, file, database_url)


@command.command()
def history(file: File = None, *, database_url: DatabaseUrl = None) -> None:
    """Write all plays that were answered, user by user, in order."""
    _export(export_history, file, database_url)


def _export(export: Export, file: Path | None, database_url: str | None) -> None:
    async def task(session: Session) -> int:
        with _opened(file) as lines, progress() as bar:
            count = 0
            line = bar.add_task("lines", total=None)
            async for text in export(session.database):
                lines.write(text)
                count += 1
                bar.advance(line)
        return count

    count = perform(configured(database_url=database_url), task)
    if file is not None:
        note(f"{count} lines written to {file}")


@contextmanager
def _opened(file: Path | None) -> Iterator[IO[str]]:
    """Where to write. A file appears under its name once it is whole."""
    if file is None:
        yield sys.stdout
        return
    part = file.with_name(f"{file.name}.part")
    try:
        with part.open("w", encoding="utf-8", newline="\n") as lines:
            yield lines
        part.replace(file)
    except OSError as error:
        raise Failed(f"{file} cannot be written: {error.strerror}.") from error
    finally:
        part.unlink(missing_ok=True)
