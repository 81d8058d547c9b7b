"""Brings a database to this release's tables, and says whether it is there."""

from pathlib import Path

import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory

import migrations
from app.storage.store import Store

VERSION = sa.text("SELECT version_num FROM alembic_version")


def config(url: str) -> Config:
    """Alembic's configuration for a database, wherever the package is installed."""
    settings = Config()
    settings.set_main_option("script_location", str(Path(migrations.__file__).parent))
    settings.set_main_option("sqlalchemy.url", url.replace("%", "%%"))
    return settings


def upgrade(url: str, to: str = "head") -> None:
    command.upgrade(config(url), to)


def downgrade(url: str, to: str) -> None:
    command.downgrade(config(url), to)


def head() -> str | None:
    return ScriptDirectory(str(Path(migrations.__file__).parent)).get_current_head()


def present(store: Store) -> str | None:
    """The revision a database is at."""
    row = store.row(VERSION)
    return None if row is None else str(row.version_num)
