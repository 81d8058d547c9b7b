"""A PostgreSQL server: the connections that read, and those that write."""

from collections.abc import Mapping, Sequence
from contextlib import closing, suppress

import asyncpg
import sqlalchemy as sa
from sqlalchemy.dialects.postgresql.asyncpg import AsyncAdapt_asyncpg_dbapi
from sqlalchemy.ext.asyncio import AsyncEngine, create_async_engine
from sqlalchemy.pool import QueuePool
from sqlalchemy.util import await_only, greenlet_spawn

from app.settings import Settings
from app.storage.prepared import Params, Prepared, Row, Statements
from app.storage.store import Changes
from app.storage.writer import apply

WRITER_CONNECTIONS = 4
FAILURES = (
    asyncpg.PostgresError,
    asyncpg.InterfaceError,
    asyncpg.InternalClientError,  # the server has just ended the connection
    AsyncAdapt_asyncpg_dbapi.Error,  # of the pool: it could not connect
    OSError,
)


class PostgreSQL:
    """A pool that reads without transactions, and a small one that writes."""

    def __init__(self, settings: Settings) -> None:
        self._reader = _asyncpg(
            settings, size=settings.pool_size, isolation_level="AUTOCOMMIT"
        )
        self._writer = _asyncpg(
            settings, size=WRITER_CONNECTIONS, isolation_level="READ COMMITTED"
        )
        self._can_prepare = not settings.pgbouncer
        self.reading = Statements(self._reader.sync_engine)
        self._writing = Statements(self._writer.sync_engine)

    def read(self, statement: sa.Executable, params: Params) -> Sequence[Row]:
        if self._can_prepare:
            with suppress(*FAILURES):
                found = self._read(statement, params)
                if found is not None:
                    return found
        return self.reading.read(statement, params)

    def _read(self, statement: sa.Executable, params: Params) -> Sequence[Row] | None:
        """What the driver finds; None: it cannot be asked so."""
        with closing(self._reader.sync_engine.raw_connection()) as pooled:
            connection: asyncpg.Connection = pooled.driver_connection
            prepared = self.reading.prepared(statement)
            if not prepared.is_fixed:
                return None
            try:
                return await_only(_found(connection, prepared, params))
            except asyncpg.InternalClientError:
                connection.terminate()  # it does not know yet that it is at an end
                raise
            finally:
                if connection.is_closed():
                    pooled.invalidate()

    def pools(self) -> Mapping[str, QueuePool]:
        engines = {"read": self._reader, "write": self._writer}
        return {
            name: engine.pool
            for name, engine in engines.items()
            if isinstance(engine.pool, QueuePool)
        }

    async def apply(self, batch: Sequence[Changes]) -> list[bool]:
        return await greenlet_spawn(self._commit, batch)

    def _commit(self, batch: Sequence[Changes]) -> list[bool]:
        with self._writer.sync_engine.begin() as connection:
            return apply(connection, self._writing, batch)

    def reconnect(self) -> None:
        for engine in (self._reader, self._writer):
            engine.sync_engine.dispose(close=False)

    async def dispose(self) -> None:
        await self._reader.dispose()
        await self._writer.dispose()


async def _found(
    connection: asyncpg.Connection, prepared: Prepared, params: Params
) -> Sequence[Row]:
    if not prepared.is_described:
        plan = await connection.prepare(prepared.text)
        prepared.describe((one.name, one.type.oid) for one in plan.get_attributes())
    return prepared.rows(
        await connection.fetch(prepared.text, *prepared.values(params))
    )


def _asyncpg(settings: Settings, *, size: int, isolation_level: str) -> AsyncEngine:
    # A transaction pooler hands each transaction another server connection, on which
    # statements prepared earlier do not exist. Without one, they are planned once: to
    # plan for the user at hand costs more than it gains.
    no_cache = {"statement_cache_size": 0, "prepared_statement_cache_size": 0}
    planned_once = {"server_settings": {"plan_cache_mode": "force_generic_plan"}}
    return create_async_engine(
        settings.database_url,
        isolation_level=isolation_level,
        pool_size=size,
        max_overflow=0,
        pool_timeout=5,
        hide_parameters=True,
        connect_args=no_cache if settings.pgbouncer else planned_once,
    )
