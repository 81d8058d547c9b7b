"""The one door to the database: opens it, runs units of work, commits, retries."""

import asyncio
import sqlite3
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from typing import Protocol, TypeVar

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError
from sqlalchemy.ext.asyncio import AsyncEngine, create_async_engine
from sqlalchemy.pool import StaticPool
from sqlalchemy.util import greenlet_spawn

from app.errors import Contended, DatabaseUnavailable
from app.settings import Settings
from app.storage.aside import Aside
from app.storage.outages import ABSENT, is_outage, state_of
from app.storage.store import Changes, Store
from app.storage.writer import Writer, apply

T = TypeVar("T")

ATTEMPTS = 64
TRANSIENT = {"40001", "40P01"}  # serialization failure, deadlock
WRITER_CONNECTIONS = 4
TURNS = 8  # computations of seconds that run or wait


class _Engines(Protocol):
    """What differs between the two databases."""

    def connect(self) -> AbstractContextManager[sa.Connection]:
        """Open a connection that reads without a transaction."""

    async def apply(self, batch: Sequence[Changes]) -> list[bool]: ...

    async def dispose(self) -> None: ...


class Database:
    """Runs units of work: each reads, decides, and is written if it still stands."""

    def __init__(self, settings: Settings) -> None:
        engines: _Engines = (
            _SQLite(settings) if settings.on_sqlite else _PostgreSQL(settings)
        )
        self._engines = engines
        self._writer = Writer(
            engines.apply, limit=settings.queue_limit, side_door=not settings.on_sqlite
        )
        self._aside = Aside()
        self._in_turn = Aside(threads=1, most=TURNS)
        self._turn = asyncio.Lock()

    async def run(self, work: Callable[[Store], T]) -> T:
        """Run a unit of work until it stands; its result is told after the commit."""
        for _ in range(ATTEMPTS):
            store = Store(self._engines.connect, self._aside, self._in_turn)
            try:
                result = await greenlet_spawn(work, store)
                if not store.changes or await self._writer.commit(store.changes):
                    return result
            except (*ABSENT, DBAPIError) as error:
                if is_outage(error):
                    raise DatabaseUnavailable(
                        "The database does not answer."
                    ) from error
                if state_of(error) not in TRANSIENT:
                    raise
        raise Contended(f"Gave up after {ATTEMPTS} attempts.")

    async def run_in_turn(self, work: Callable[[Store], T]) -> T:
        """Run one of those units that all claim the same: here they do not compete."""
        async with self._turn:
            return await self.run(work)

    async def close(self) -> None:
        await self._writer.close()
        await self._engines.dispose()
        self._aside.close()
        self._in_turn.close()


class _SQLite:
    """One thread writes; reading is done where the caller runs."""

    def __init__(self, settings: Settings) -> None:
        self._reader = sa.create_engine(
            settings.database_url,
            poolclass=StaticPool,
            isolation_level="AUTOCOMMIT",
            hide_parameters=True,
            connect_args={"check_same_thread": False},
        )
        self._writer = sa.create_engine(
            settings.database_url,
            poolclass=StaticPool,
            hide_parameters=True,
            connect_args={"check_same_thread": False},
        )
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="writer")
        for engine in (self._reader, self._writer):
            sa.event.listen(engine, "connect", prepare_sqlite)
        sa.event.listen(self._writer, "begin", begin_immediate)
        self._connection: sa.Connection | None = None

    def connect(self) -> AbstractContextManager[sa.Connection]:
        if self._connection is None:
            self._connection = self._reader.connect()
        return nullcontext(self._connection)  # kept: opening costs as much as reading

    async def apply(self, batch: Sequence[Changes]) -> list[bool]:
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._commit, batch)

    def _commit(self, batch: Sequence[Changes]) -> list[bool]:
        with self._writer.begin() as connection:
            return apply(connection, batch)

    async def dispose(self) -> None:
        self._thread.shutdown()
        if self._connection is not None:
            self._connection.close()
        self._reader.dispose()
        self._writer.dispose()


def prepare_sqlite(connection: sqlite3.Connection, _record: object) -> None:
    """Full durability, readers that never wait, and transactions of our own making.

    The driver's own transactions begin too late: two that read before they write
    lose one another's updates without an error.
    """
    connection.isolation_level = None
    for pragma in (
        "journal_mode=WAL",
        "synchronous=FULL",
        "busy_timeout=10000",
        "foreign_keys=ON",
    ):
        connection.execute(f"PRAGMA {pragma}")


def begin_immediate(connection: sa.Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE")


class _PostgreSQL:
    """A pool that reads without transactions, and a small one that writes."""

    def __init__(self, settings: Settings) -> None:
        self._reader = _asyncpg(
            settings, size=settings.pool_size, isolation_level="AUTOCOMMIT"
        )
        self._writer = _asyncpg(
            settings, size=WRITER_CONNECTIONS, isolation_level="READ COMMITTED"
        )

    def connect(self) -> AbstractContextManager[sa.Connection]:
        return self._reader.sync_engine.connect()

    async def apply(self, batch: Sequence[Changes]) -> list[bool]:
        async with self._writer.begin() as connection:
            return await connection.run_sync(apply, batch)

    async def dispose(self) -> None:
        await self._reader.dispose()
        await self._writer.dispose()


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
