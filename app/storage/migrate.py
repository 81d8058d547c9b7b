"""Brings a database to this release's tables, and says whether it is there."""

import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path

import sqlalchemy as sa
import structlog
from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy.exc import DBAPIError

import migrations
from app.errors import Contended, DatabaseUnavailable
from app.storage.outages import is_missing_table, is_outage, state_of
from app.storage.store import Store

IN_USE = {"40P01", "55P03"}  # deadlock, no lock in time
ATTEMPTS = 10
PAUSE = 1.0  # seconds between two of them at most
VERSION = sa.text("SELECT version_num FROM alembic_version")

logger = structlog.get_logger()


def config(url: str) -> Config:
    """Alembic's configuration for a database, wherever the package is installed."""
    settings = Config()
    settings.set_main_option("script_location", str(Path(migrations.__file__).parent))
    settings.set_main_option("sqlalchemy.url", url.replace("%", "%%"))
    return settings


def upgrade(url: str, to: str = "head") -> None:
    """Change the tables.

    Raises:
        Contended: requests go on that use them; nothing was changed.
    """
    _insist(partial(command.upgrade, config(url), to))


def downgrade(url: str, to: str) -> None:
    """Change them back; see `upgrade`."""
    _insist(partial(command.downgrade, config(url), to))


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


def _insist(work: Callable[[], None]) -> None:
    """Run it until it has its locks: requests do not wait for it, and come first."""
    for left in reversed(range(ATTEMPTS)):
        try:
            with _outages_told():
                work()
        except DBAPIError as error:
            if state_of(error) not in IN_USE:
                raise
            if left == 0:
                raise Contended("Requests use the tables all the time.") from error
            logger.warning("tables are in use", attempts_left=left)
            time.sleep(random.uniform(0, PAUSE))  # noqa: S311 - no secret
        else:
            return


@contextmanager
def _outages_told() -> Iterator[None]:
    try:
        yield
    except Exception as error:
        if not is_outage(error):
            raise
        raise DatabaseUnavailable("The database does not answer.") from error
