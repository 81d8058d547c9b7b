"""`encore migrate`: brings the database to this release's tables, or back."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer
from alembic.util import CommandError

from app.cli.console import AsJson, Failed, note, say, show_json
from app.cli.session import DatabaseUrl, configured, place, revision_of, unreachable
from app.errors import Contended, DatabaseUnavailable
from app.settings import Settings
from app.storage import migrate
from app.storage.citus import statements


def command(
    *,
    down_to: Annotated[
        str | None,
        typer.Option(help="Go back to this revision; `base` is before the first."),
    ] = None,
    citus: Annotated[
        bool,
        typer.Option(
            "--citus", help="Only print SQL that distributes the tables over nodes."
        ),
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Go back without asking.")] = False,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Bring the database to this release's tables.

    To do it again changes nothing. Going back loses what newer tables hold.
    """
    if citus:
        say("\n".join(f"{statement};" for statement in statements()))
        return
    settings = configured(database_url=database_url)
    if down_to is not None and not yes:
        typer.confirm(f"Go back to {down_to}, and lose what is newer?", abort=True)
    before = asyncio.run(revision_of(settings))
    if down_to is not None:
        _bring_back(settings, down_to)
    elif migrate.is_behind(before):
        bring_up_to_date(settings)
    elif before != migrate.head():
        note("The tables are of a later release, and are left as they are.")
    after = asyncio.run(revision_of(settings))
    if as_json:
        show_json({"database": place(settings), "from": before, "to": after})
    else:
        say(f"{place(settings)}: {before or 'empty'} -> {after or 'empty'}")


def bring_up_to_date(settings: Settings) -> None:
    with _told(settings):
        migrate.upgrade(settings.database_url)


def _bring_back(settings: Settings, to: str) -> None:
    with _told(settings):
        migrate.downgrade(settings.database_url, to)


@contextmanager
def _told(settings: Settings) -> Iterator[None]:
    try:
        yield
    except CommandError as error:
        raise Failed(str(error), status=2) from error
    except Contended as error:
        raise Failed(f"{error.detail} Nothing was changed; try again.") from error
    except DatabaseUnavailable as error:
        raise unreachable(settings, error) from error
