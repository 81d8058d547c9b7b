"""The yardstick on `sqlite3`: a thread that writes whatever waits, and flushes once."""

import asyncio
import sqlite3
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from queue import SimpleQueue

from benchmarks.throughput import statements
from benchmarks.throughput.statements import Asked, Offered, Standing, Taken

MARKS = "?" * 10
BY_USER = statements.BY_USER.format(*MARKS)
BY_PLAY = statements.BY_PLAY.format(*MARKS)
MOVE = statements.MOVE.format(*MARKS)
ENTER = statements.ENTER.format(*MARKS)
CLOSE = statements.CLOSE.format(*MARKS)
KEEP = statements.KEEP.format(*MARKS)
TYPES = {"uuid": "TEXT", "time": "REAL", "float": "REAL", "bytes": "BLOB"}
Statement = tuple[str, tuple[object, ...]]


class SQLite:
    """Reads where it is called; writes are handed to the thread."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._reader = sqlite3.connect(
            path, isolation_level=None, check_same_thread=False
        )
        self._queue: SimpleQueue[tuple[list[Statement], asyncio.Future[bool]]] = (
            SimpleQueue()
        )
        threading.Thread(target=self._write, daemon=True).start()

    async def open(self) -> None:
        """There is nothing to open in a loop."""

    @asynccontextmanager
    async def unit(self) -> AsyncIterator["SQLite"]:
        yield self

    async def by_user(self, user: str) -> Standing:
        row = self._reader.execute(BY_USER, (user,)).fetchone()
        return Standing(row[0] or 0, row[1], row[2] or 0, row[3] or b"", *row[4:])

    async def by_play(self, play: str) -> Asked:
        return Asked(*self._reader.execute(BY_PLAY, (play,)).fetchone())

    async def offer(self, play: Offered, version: int) -> bool:
        now = time.time()
        moved = (play.user, play.slot, play.play, version + 1, now)
        return await self._commit([(MOVE, moved), (ENTER, (*play, now))])

    async def take(self, taken: Taken, slot: int, version: int) -> bool:
        now = time.time()
        return await self._commit(
            [
                (MOVE, (taken.user, slot, None, version + 1, now)),
                (CLOSE, (taken.signal, now, taken.user, taken.play)),
                (KEEP, (taken.user, taken.packed)),
            ]
        )

    async def _commit(self, writes: list[Statement]) -> bool:
        done: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._queue.put((writes, done))
        return await done

    def _write(self) -> None:
        database = sqlite3.connect(self._path, isolation_level=None)
        database.execute("PRAGMA synchronous=FULL")
        while True:
            batch = [self._queue.get()]
            while not self._queue.empty() and len(batch) < 256:
                batch.append(self._queue.get())
            database.execute("BEGIN IMMEDIATE")
            results = [_apply(database, writes) for writes, _ in batch]
            database.execute("COMMIT")
            for (_, done), stands in zip(batch, results, strict=True):
                done.get_loop().call_soon_threadsafe(done.set_result, stands)


def _apply(database: sqlite3.Connection, writes: list[Statement]) -> bool:
    for number, (sql, values) in enumerate(writes):
        if database.execute(sql, values).rowcount == 0 and number == 0:
            return False
    return True
