"""From the command line to a unit of work: settings, database, what is in force."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar
from urllib.parse import urlsplit

import typer
from pydantic import ValidationError
from pydantic_core import ErrorDetails

from app.api.faults import message_of
from app.cli.console import Failed
from app.errors import DatabaseUnavailable
from app.services.guard_fallback import Fallback
from app.services.live import Live
from app.settings import Settings, Telemetry
from app.storage import migrate
from app.storage.database import Database
from app.storage.store import Store

T = TypeVar("T")

DatabaseUrl = Annotated[
    str | None,
    typer.Option(
        "--database-url",
        help="sqlite:///FILE or postgresql://…, else ENCORE_DATABASE_URL.",
        show_default=False,
    ),
]


@dataclass(frozen=True, slots=True)
class Session:
    """An open database, and what is in force in it."""

    settings: Settings
    database: Database
    live: Live


def configured(**options: object) -> Settings:
    """The settings of the environment, and over them the options that were given."""
    given = {name: value for name, value in options.items() if value is not None}
    try:
        settings = Settings.model_validate(given)
        Fallback.of(settings)
        Telemetry()
    except ValidationError as error:
        faults = [_fault(error.title, fault) for fault in error.errors()]
        raise Failed("; ".join(faults), status=2) from error
    except ValueError as error:
        raise Failed(str(error), status=2) from error
    return settings


def _fault(title: str, fault: ErrorDetails) -> str:
    """What is wrong, with the variable where one is at fault."""
    prefix = "OTEL_" if title == Telemetry.__name__ else "ENCORE_"
    names = [f"{prefix}{name}".upper() for name in fault["loc"]]
    return ": ".join((*names, message_of(fault)))


def perform(
    settings: Settings, task: Callable[[Session], Coroutine[None, None, T]]
) -> T:
    """Run a task on a database that is migrated."""

    async def within() -> T:
        async with opened(settings) as session:
            return await task(session)

    return asyncio.run(within())


def perform_unit(settings: Settings, work: Callable[[Store], T]) -> T:
    """Run one unit of work on a database that is migrated."""

    async def task(session: Session) -> T:
        return await session.database.run(work)

    return perform(settings, task)


@asynccontextmanager
async def opened(settings: Settings) -> AsyncIterator[Session]:
    """Open a database, and see that its tables are those of this release."""
    present = await revision_of(settings)
    if present != migrate.head():
        raise unsuited(settings, present)
    database = Database(settings)
    try:
        yield Session(settings, database, Live(settings.pending_ttl))
    except DatabaseUnavailable as error:
        raise unreachable(settings, error) from error
    finally:
        await database.close()


def unsuited(settings: Settings, present: str | None) -> Failed:
    """Say that a database has other tables."""
    there = f"there: {present or 'none'}, needed: {migrate.head()}"
    whose = f"The tables of {place(settings)} are not those of this release ({there})."
    if migrate.is_behind(present):
        return Failed(f"{whose} Run `encore migrate`.")
    return Failed(f"{whose} They are of a later one: use its `encore`.")


async def revision_of(settings: Settings) -> str | None:
    """Which tables a database has. A file that is missing is not made."""
    if settings.on_sqlite and not _file(settings).is_file():
        return None
    database = Database(settings)
    try:
        return await database.run(migrate.present)
    except DatabaseUnavailable as error:
        raise unreachable(settings, error) from error
    finally:
        await database.close()


def _file(settings: Settings) -> Path:
    return Path(settings.database_url.removeprefix("sqlite:///"))


def place(settings: Settings) -> str:
    """Where a database is, without the password."""
    url = urlsplit(settings.database_url)
    if settings.on_sqlite or url.password is None:
        return settings.database_url
    where = url.netloc.rpartition("@")[2]
    return url._replace(netloc=f"{url.username}:…@{where}").geturl()


def unreachable(settings: Settings, error: DatabaseUnavailable) -> Failed:
    """Say which database does not answer, and why."""
    reason = str(error.__cause__ or error).splitlines()[0]
    return Failed(f"The database {place(settings)} does not answer: {reason}")
