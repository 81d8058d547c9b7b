"""Runs revisions on SQLite or PostgreSQL, one process at a time."""

import asyncio
import re

import sqlalchemy as sa
from alembic import context
from sqlalchemy.ext.asyncio import create_async_engine

from app.settings import Settings
from app.storage.tables import metadata

ONE_AT_A_TIME = sa.text("SELECT pg_advisory_xact_lock(hashtext('encore.migrate'))")
PARTITION = re.compile(r"plays_\d+")
SHORT_LOCKS = sa.text("SET LOCAL lock_timeout = '2s'")


def run(connection: sa.Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=metadata,
        render_as_batch=True,
        compare_type=True,
        include_name=_is_ours,
    )
    with context.begin_transaction():
        if connection.dialect.name == "postgresql":
            connection.execute(ONE_AT_A_TIME)
            connection.execute(SHORT_LOCKS)
        context.run_migrations()


def _is_ours(name: str | None, kind: str, _parents: object) -> bool:
    """Whether the tables of the code tell of it: of partitions they do not."""
    return not (kind == "table" and name and PARTITION.fullmatch(name))


async def run_on_postgresql(url: str) -> None:
    engine = create_async_engine(url, poolclass=sa.NullPool)
    async with engine.connect() as connection:
        await connection.run_sync(run)
        await connection.commit()
    await engine.dispose()


def run_on_sqlite(url: str) -> None:
    engine = sa.create_engine(url, poolclass=sa.NullPool)
    with engine.connect() as connection:
        run(connection)
        connection.commit()
    engine.dispose()


url = context.config.get_main_option("sqlalchemy.url") or Settings().database_url
if url.startswith("sqlite"):
    run_on_sqlite(url)
else:
    asyncio.run(run_on_postgresql(url))
