"""Group commit: many units of work, one transaction, one flush to disk.

A unit is applied if the versions it relied on still stand; otherwise its caller runs
it again. If a batch fails, but not for an outage, its members are applied one by one,
so that a unit in error fails alone. Callers hear of success only after the commit.
"""

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass

import sqlalchemy as sa
from sqlalchemy.dialects.postgresql import ARRAY

from app.errors import Overloaded
from app.metrics import COMMIT_UNITS, COMMITS
from app.storage.outages import is_outage
from app.storage.prepared import Params, Statements
from app.storage.store import Changes, chunks
from app.storage.tables import revision, users

BATCH = 256

ENTER_USER = sa.text(
    "INSERT INTO users (id, slot, version, last_seen)"
    " VALUES (:id, 0, 0, CURRENT_TIMESTAMP) ON CONFLICT (id) DO NOTHING"
)
VERSIONS = sa.select(users.c.id, users.c.version).order_by(users.c.id)
IDS: sa.BindParameter[object] = sa.bindparam("ids", expanding=True)
VERSIONS_SQLITE = VERSIONS.where(users.c.id.in_(IDS))
VERSIONS_POSTGRESQL = VERSIONS.where(
    users.c.id == sa.any_(sa.bindparam("ids", type_=ARRAY(sa.String)))
).with_for_update()
REVISION = sa.select(revision).with_for_update()

Apply = Callable[[Sequence[Changes]], Awaitable[list[bool]]]


def apply(
    connection: sa.Connection, statements: Statements, batch: Sequence[Changes]
) -> list[bool]:
    """Write the units that still stand; tell which they were."""
    standing = _standing(connection, batch)
    merged: dict[sa.Executable, list[Params]] = {}
    for changes, stands in zip(batch, standing, strict=True):
        if stands:
            for statement, rows in changes.writes.items():
                merged.setdefault(statement, []).extend(rows)
    for statement in sorted(merged, key=_inserts_last):
        statements.write(connection, statement, merged[statement])
    for changes, stands in zip(batch, standing, strict=True):
        if stands:
            _write_bulk(connection, statements, changes)
    return standing


def _inserts_last(statement: sa.Executable) -> bool:
    """A pending play is closed before the next one is entered."""
    return isinstance(statement, sa.Insert)


def _write_bulk(
    connection: sa.Connection, statements: Statements, changes: Changes
) -> None:
    for statement, rows in changes.bulk:
        for chunk in chunks(rows()):
            statements.write(connection, statement, chunk)


def _standing(connection: sa.Connection, batch: Sequence[Changes]) -> list[bool]:
    versions = _user_versions(connection, batch)
    parts = _revision(connection, batch)
    standing = []
    for changes in batch:
        stands = all(
            versions.get(user) == version for user, version in changes.users.items()
        ) and all(parts[part] == number for part, number in changes.revision.items())
        if stands:  # a second unit of the same user or part has lost
            for user in changes.users:
                versions.pop(user)
            parts.update(dict.fromkeys(changes.revision, -1))
        standing.append(stands)
    return standing


def _user_versions(
    connection: sa.Connection, batch: Sequence[Changes]
) -> dict[str, int]:
    new = {u for changes in batch for u, v in changes.users.items() if v == 0}
    if new:
        connection.execute(ENTER_USER, [{"id": user} for user in sorted(new)])
    ids = sorted({user for changes in batch for user in changes.users})
    if not ids:
        return {}
    on_sqlite = connection.dialect.name == "sqlite"
    statement = VERSIONS_SQLITE if on_sqlite else VERSIONS_POSTGRESQL
    return {row.id: row.version for row in connection.execute(statement, {"ids": ids})}


def _revision(connection: sa.Connection, batch: Sequence[Changes]) -> dict[str, int]:
    if not any(changes.revision for changes in batch):
        return {}
    return dict(connection.execute(REVISION).mappings().one())


@dataclass(slots=True)
class _Waiting:
    changes: Changes
    standing: asyncio.Future[bool]


class Writer:
    """Takes whatever waits, commits it together, answers each."""

    def __init__(self, apply: Apply, *, limit: int, side_door: bool) -> None:
        self._apply = apply
        self.limit = limit
        self._side_door = side_door  # large units do not stand in the queue
        self._queue: deque[_Waiting] = deque()
        self._task: asyncio.Task[None] | None = None

    @property
    def waiting(self) -> int:
        return len(self._queue)

    async def commit(self, changes: Changes) -> bool:
        """Whether the unit was written; False: what it relied on has changed."""
        if self._side_door and changes.bulk:
            return (await self._apply([changes]))[0]
        if len(self._queue) >= self.limit:
            raise Overloaded(f"{self.limit} units of work are waiting to be written.")
        waiting = _Waiting(changes, asyncio.get_running_loop().create_future())
        self._queue.append(waiting)
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._drain())
        return await waiting.standing

    async def close(self) -> None:
        """Finish what waits."""
        if self._task is not None:
            await self._task

    async def _drain(self) -> None:
        while self._queue:
            batch = self._take()
            try:
                await self._write(batch)
            except BaseException:
                for waiting in (*batch, *self._queue):
                    waiting.standing.cancel()
                self._queue.clear()
                raise

    def _take(self) -> list[_Waiting]:
        batch = [self._queue.popleft()]
        while self._queue and len(batch) < BATCH and not _alone(batch[-1]):
            if _alone(self._queue[0]):
                break
            batch.append(self._queue.popleft())
        return batch

    async def _write(self, batch: list[_Waiting]) -> None:
        began = time.perf_counter()
        try:
            standing = await self._apply([waiting.changes for waiting in batch])
        except Exception as error:  # noqa: BLE001 - handed to those it belongs to
            if len(batch) > 1 and not is_outage(error):
                for waiting in batch:
                    await self._write([waiting])
            for waiting in batch:
                _fail(waiting, error)
        else:
            COMMITS.observe(time.perf_counter() - began)
            COMMIT_UNITS.observe(len(batch))
            for waiting, stands in zip(batch, standing, strict=True):
                _resolve(waiting, stands=stands)


def _alone(waiting: _Waiting) -> bool:
    return bool(waiting.changes.bulk)


def _resolve(waiting: _Waiting, *, stands: bool) -> None:
    if not waiting.standing.done():
        waiting.standing.set_result(stands)


def _fail(waiting: _Waiting, error: Exception) -> None:
    if not waiting.standing.done():
        waiting.standing.set_exception(error)
