"""The one door to the database: opens it, runs units of work, commits, retries."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import QueuePool
from sqlalchemy.util import greenlet_spawn

from app import metrics, tracing
from app.errors import Contended, DatabaseUnavailable
from app.settings import Settings
from app.storage import traced
from app.storage.aside import Aside
from app.storage.outages import ABSENT, is_outage, state_of
from app.storage.postgresql import PostgreSQL
from app.storage.prepared import Params, Row, Statements
from app.storage.sqlite import SQLite
from app.storage.store import Changes, Read, Store
from app.storage.writer import Writer

T = TypeVar("T")
Commit = Callable[[Changes], Awaitable[bool]]

ATTEMPTS = 64
TRANSIENT = {"40001", "40P01"}  # serialization failure, deadlock
TURNS = 8  # computations of seconds that run or wait


@dataclass(frozen=True, slots=True)
class Load:
    """How much a database has to do.

    queued:      units of work that wait to be written
    limit:       how many may
    connections: by pool, how many are in use, and how many there may be
    """

    queued: int
    limit: int
    connections: Mapping[str, tuple[int, int]]


class _Engines(Protocol):
    """What differs between the two databases."""

    reading: Statements

    def read(self, statement: sa.Executable, params: Params) -> Sequence[Row]:
        """Read without a transaction."""

    def pools(self) -> Mapping[str, QueuePool]: ...

    async def apply(self, batch: Sequence[Changes]) -> list[bool]: ...

    def reconnect(self) -> None:
        """One connection is gone, so all may be: use none of them again."""

    async def dispose(self) -> None: ...


class Database:
    """Runs units of work: each reads, decides, and is written if it still stands."""

    def __init__(self, settings: Settings, *, is_traced: bool = False) -> None:
        engines: _Engines = (
            SQLite(settings.database_url)
            if settings.on_sqlite
            else PostgreSQL(settings)
        )
        self._engines = engines
        self._writer = Writer(
            engines.apply, limit=settings.queue_limit, side_door=not settings.on_sqlite
        )
        self._is_traced = is_traced
        self._read: Read = engines.read
        self._commit: Commit = self._writer.commit
        if is_traced:
            self._read = traced.reads(engines.reading, engines.read)
            self._commit = tracing.noted("commit", self._writer.commit)
        self._aside = Aside()
        self._in_turn = Aside(threads=1, most=TURNS)
        self._turn = asyncio.Lock()

    async def run(self, work: Callable[[Store], T]) -> T:
        """Run a unit of work until it stands; its result is told after the commit."""
        for _ in range(ATTEMPTS):
            store = Store(self._read, self._aside, self._in_turn)
            try:
                perform = traced.perform if self._is_traced else greenlet_spawn
                result = await perform(work, store)
                if not store.changes or await self._commit(store.changes):
                    return result
                metrics.retries("moved").inc()
            except (*ABSENT, DBAPIError) as error:
                if is_outage(error):
                    if getattr(error, "connection_invalidated", False):
                        self._engines.reconnect()
                    raise DatabaseUnavailable(
                        "The database does not answer."
                    ) from error
                if state_of(error) not in TRANSIENT:
                    raise
                metrics.retries("database").inc()
        raise Contended(f"Gave up after {ATTEMPTS} attempts.")

    async def run_in_turn(self, work: Callable[[Store], T]) -> T:
        """Run one of those units that all claim the same: here they do not compete."""
        async with self._turn:
            return await self.run(work)

    def load(self) -> Load:
        """How much there is to do at this moment."""
        connections = {
            name: (pool.checkedout(), pool.size())
            for name, pool in self._engines.pools().items()
        }
        return Load(self._writer.waiting, self._writer.limit, connections)

    async def close(self) -> None:
        await self._writer.close()
        await self._engines.dispose()
        self._aside.close()
        self._in_turn.close()
