"""An SQLite file: who reads it, who writes it, and how they are opened."""

import asyncio
import sqlite3
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import sqlalchemy as sa
from sqlalchemy.pool import QueuePool, StaticPool

from app.storage.prepared import Params, Row, Statements
from app.storage.store import Changes
from app.storage.writer import apply


class SQLite:
    """One thread writes; reading is done where the caller runs."""

    def __init__(self, url: str) -> None:
        self._reader = sa.create_engine(
            url,
            poolclass=StaticPool,
            isolation_level="AUTOCOMMIT",
            hide_parameters=True,
            connect_args={"check_same_thread": False},
        )
        self._writer = sa.create_engine(
            url,
            poolclass=StaticPool,
            hide_parameters=True,
            connect_args={"check_same_thread": False},
        )
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="writer")
        for engine in (self._reader, self._writer):
            sa.event.listen(engine, "connect", prepare)
        sa.event.listen(self._writer, "begin", begin_immediate)
        self.reading = Statements(self._reader)
        self._writing = Statements(self._writer)
        self._connection: sqlite3.Connection | None = None

    def read(self, statement: sa.Executable, params: Params) -> Sequence[Row]:
        if self._connection is None:
            self._connection = self._open()
        prepared = self.reading.prepared(statement)
        if not prepared.is_fixed:
            return self.reading.read(statement, params)
        try:
            cursor = self._connection.execute(prepared.text, prepared.values(params))
            found = cursor.fetchall()
        except sqlite3.Error:
            return self.reading.read(statement, params)
        if not prepared.is_described:
            prepared.describe((name, None) for name, *_ in cursor.description or ())
        return prepared.rows(found)

    def _open(self) -> sqlite3.Connection:
        """The one connection of the pool, without what watches over its use."""
        with self._reader.connect() as connection:
            driver = connection.connection.driver_connection
        if not isinstance(driver, sqlite3.Connection):
            raise TypeError(driver)
        return driver

    def pools(self) -> Mapping[str, QueuePool]:
        return {}

    async def apply(self, batch: Sequence[Changes]) -> list[bool]:
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._commit, batch)

    def reconnect(self) -> None:
        """A file has no connections that others could close."""

    def _commit(self, batch: Sequence[Changes]) -> list[bool]:
        with self._writer.begin() as connection:
            return apply(connection, self._writing, batch)

    async def dispose(self) -> None:
        self._thread.shutdown()
        self._reader.dispose()
        self._writer.dispose()


def prepare(connection: sqlite3.Connection, _record: object) -> None:
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
