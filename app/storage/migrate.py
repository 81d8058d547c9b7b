"""Brings a database to this release's tables, and says whether it is there."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy.exc import DBAPIError

import migrations
from app.errors import DatabaseUnavailable
from app.storage.outages import is_missing_table, is_outage
from app.storage.store import Store

VERSION = sa.text("SELECT version_num FROM alembic_version")


def config(url: str) -> Config:
    """Alembic's configuration for a database, wherever the package is installed."""
    settings = Config()
    settings.set_main_option("script_location", str(Path(migrations.__file__).parent))
    settings.set_main_option("sqlalchemy.url", url.replace("%", "%%"))
    return settings


def upgrade(url: str, to: str = "head") -> None:
    with _outages_told():
        command.upgrade(config(url), to)


def downgrade(url: str, to: str) -> None:
    with _outages_told():
        command.downgrade(config(url), to)


@cache
def known() -> tuple[str, ...]:
    """The revisions that this release knows, the one that it needs first."""
    scripts = ScriptDirectory(str(Path(migrations.__file__).parent))
    return tuple(script.revision for script in scripts.walk_revisions())


def head() -> str:
    """The revision that this release needs."""
    return known()[0]


def is_behind(revision: str | None) -> bool:
    """Whether a database lacks tables that this release needs.

    One that this release does not know is of a later release: its tables are added to
    before the processes of this one are replaced, and stay if they come back.
    """
    return revision is None or revision in known()[1:]


def present(store: Store) -> str | None:
    """The revision a database is at, None if it was never migrated."""
    try:
        row = store.row(VERSION)
    except DBAPIError as error:
        if is_missing_table(error):
            return None
        raise
    return None if row is None else str(row.version_num)


@contextmanager
def _outages_told() -> Iterator[None]:
    try:
        yield
    except Exception as error:
        if not is_outage(error):
            raise
        raise DatabaseUnavailable("The database does not answer.") from error
