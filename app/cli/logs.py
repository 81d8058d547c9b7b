"""Logs of plays that commands learn from: files, or the database."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import typer

from app.api.schemas.lines import CATALOGUE
from app.cli.console import Failed, progress
from app.cli.files import opened
from app.cli.importing import refused
from app.cli.session import Session, configured, perform
from app.errors import Fault, InvalidImport
from app.services.items import NewItem
from app.services.logs import CannotLearn, catalogue, log
from learning import Plays

UnitOfTime: TypeAlias = Literal["milliseconds", "seconds", "minutes"]
Exported: TypeAlias = Literal["artist", "track"]


def _named(name: str, what: str) -> typer.models.OptionInfo:
    option: typer.models.OptionInfo = typer.Option(
        f"--{name}",
        help=f"Column of {what}; left out: found by its name.",
        show_default=False,
        rich_help_panel="Columns of the files",
    )
    return option


Files = Annotated[
    list[Path] | None,
    typer.Argument(
        help="Logs of plays: CSV, NDJSON, Parquet, or folders of them. Left out: the"
        " plays of the database.",
        show_default=False,
    ),
]
User = Annotated[str | None, _named("user", "users")]
Arm = Annotated[str | None, _named("arm", "what was played")]
Time = Annotated[str | None, _named("time", "times")]
Order = Annotated[str | None, _named("order", "the order of plays")]
Signal = Annotated[str | None, _named("signal", "names of answers")]
Fraction = Annotated[str | None, _named("fraction", "shares played")]
Like = Annotated[str | None, _named("like", "likes, 0 or 1")]
Propensity = Annotated[str | None, _named("propensity", "chances of being chosen")]
TimeUnit = Annotated[
    UnitOfTime | None,
    typer.Option(
        "--unit",
        help="What a time counts, if it is a number.",
        show_default=False,
        rich_help_panel="Columns of the files",
    ),
]
Spotify = Annotated[
    Exported | None,
    typer.Option(
        help="The files are exports of Spotify's, a folder or zip for each person.",
        show_default=False,
    ),
]


@dataclass(frozen=True, slots=True)
class Wanted:
    """Where a log is.

    columns: their names by what they say
    """

    files: Sequence[Path]
    columns: dict[str, str | None]
    unit: UnitOfTime | None
    spotify: Exported | None
    database_url: str | None


def read(wanted: Wanted) -> Plays:
    """Read a log; what is wrong with it is told by row."""
    given = [name for name, column in wanted.columns.items() if column is not None]
    if not wanted.files:
        for option in (*given, *(["spotify"] if wanted.spotify else [])):
            raise Failed(f"--{option} goes with files.", status=2)
        return _of_database(wanted.database_url)
    if wanted.database_url is not None:
        raise Failed("--database-url does not go with files.", status=2)
    if wanted.spotify is not None and given:
        raise Failed(f"--spotify does not go with --{given[0]}.", status=2)
    return _of_files(wanted)


def items(wanted: Wanted, file: Path | None) -> Sequence[NewItem] | None:
    """The items of a file, or of the database; None: only the log names them."""
    if file is not None:
        return _items_of(file)
    if wanted.files:
        return None

    async def task(session: Session) -> Sequence[NewItem]:
        return await catalogue(session.database)

    return perform(configured(database_url=wanted.database_url), task)


def _items_of(file: Path) -> Sequence[NewItem]:
    found: dict[str, NewItem] = {}
    with opened(file, None, CATALOGUE) as lines:
        faults = lines.faults()
        for line, item in lines.entries(faults):
            if item.id in found:
                faults.add(line, Fault("id", "is there twice", item.id))
            found[item.id] = item
    try:
        faults.refuse()
    except InvalidImport as error:
        raise refused(error) from error
    return [*found.values()]


def _of_files(wanted: Wanted) -> Plays:
    try:
        from learning import reading  # noqa: PLC0415 - of an extra
    except ModuleNotFoundError as error:
        message = f"{error.name} is missing: pip install '.[learn]' in a clone."
        raise Failed(message) from error
    try:
        if wanted.spotify is not None:
            return reading.read_spotify(wanted.files, wanted.spotify)
        columns = reading.Columns(**wanted.columns, unit=wanted.unit)
        return reading.read(wanted.files, columns)
    except reading.InvalidLog as error:
        raise Failed(str(error), status=2) from error


def _of_database(database_url: str | None) -> Plays:
    async def task(session: Session) -> Plays:
        with progress() as bar:
            plays = bar.add_task("plays", total=None)
            return await log(
                session.database, lambda count: bar.update(plays, completed=count)
            )

    try:
        return perform(configured(database_url=database_url), task)
    except CannotLearn as error:
        raise Failed(str(error)) from error
