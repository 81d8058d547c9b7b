"""The yardstick on asyncpg: a transaction for each request, in a pool."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime

import asyncpg

from benchmarks.throughput import statements
from benchmarks.throughput.statements import Asked, Offered, Standing, Taken

MARKS = [f"${number}" for number in range(1, 11)]
BY_USER = statements.BY_USER.format(*MARKS)
BY_PLAY = statements.BY_PLAY.format(*MARKS)
MOVE = statements.MOVE.format(*MARKS)
ENTER = statements.ENTER.format(*MARKS)
CLOSE = statements.CLOSE.format(*MARKS)
KEEP = statements.KEEP.format(*MARKS)
TYPES = {
    "uuid": "UUID",
    "time": "TIMESTAMPTZ",
    "float": "DOUBLE PRECISION",
    "bytes": "BYTEA",
}
CONNECTIONS = 16


class PostgreSQL:
    """A pool of connections, which are not reset: nothing is set in them."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._pool: asyncpg.Pool | None = None

    async def open(self) -> None:
        self._pool = await asyncpg.create_pool(
            self._url, min_size=CONNECTIONS, max_size=CONNECTIONS, reset=_nothing
        )

    @asynccontextmanager
    async def unit(self) -> AsyncIterator["Unit"]:
        if self._pool is None:
            raise RuntimeError("not open")
        async with self._pool.acquire() as connection, connection.transaction():
            yield Unit(connection)


class Unit:
    """A transaction."""

    def __init__(self, connection: asyncpg.Connection) -> None:
        self._connection = connection

    async def by_user(self, user: str) -> Standing:
        row = await self._connection.fetchrow(BY_USER, user)
        pending = None if row[1] is None else str(row[1])
        return Standing(row[0] or 0, pending, row[2] or 0, row[3] or b"", *row[4:])

    async def by_play(self, play: str) -> Asked:
        return Asked(*await self._connection.fetchrow(BY_PLAY, play))

    async def offer(self, play: Offered, version: int) -> bool:
        now = datetime.now(UTC)
        moved = await self._connection.execute(
            MOVE, play.user, play.slot, play.play, version + 1, now
        )
        if moved != "INSERT 0 1":
            return False
        await self._connection.execute(ENTER, *play, now)
        return True

    async def take(self, taken: Taken, slot: int, version: int) -> bool:
        now, user = datetime.now(UTC), taken.user
        moved = await self._connection.execute(MOVE, user, slot, None, version + 1, now)
        if moved != "INSERT 0 1":
            return False
        await self._connection.execute(CLOSE, taken.signal, now, user, taken.play)
        await self._connection.execute(KEEP, user, taken.packed)
        return True


async def _nothing(_connection: asyncpg.Connection) -> None:
    pass
