"""A unit of work: what it reads at once, and what it wants written.

Reads go straight to the database. Writes are only noted, together with the versions
on which the unit relied; the writer applies them in a group commit if those versions
still stand (compare and set), else the unit runs again on what has changed.
"""

import asyncio
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias, TypeVar

import sqlalchemy as sa
from sqlalchemy.util import await_only

from app.storage.aside import Aside
from app.storage.prepared import Params, Row

T = TypeVar("T")
Read: TypeAlias = Callable[[sa.Executable, Params], Sequence[Row]]


class Rows(Protocol):
    """Rows to write, made anew for each try."""

    def __call__(self) -> Iterator[Params]: ...


@dataclass(slots=True)
class Changes:
    """What a unit of work wants written, and the versions on which that relies."""

    users: dict[str, int] = field(default_factory=dict)
    revision: dict[str, int] = field(default_factory=dict)
    writes: dict[sa.Executable, list[Params]] = field(default_factory=dict)
    bulk: list[tuple[sa.Executable, Rows]] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.writes or self.bulk)


class Store:
    """All queries of one unit of work."""

    def __init__(self, read: Read, aside: Aside, in_turn: Aside) -> None:
        self._read = read
        self._aside = aside
        self._in_turn = in_turn
        self.changes = Changes()

    def rows(
        self, statement: sa.Executable, params: Params | None = None
    ) -> Sequence[Row]:
        return self._read(statement, params or {})

    def row(self, statement: sa.Executable, params: Params | None = None) -> Row | None:
        rows = self._read(statement, params or {})
        return rows[0] if rows else None

    def write(self, statement: sa.Executable, *rows: Params) -> None:
        """Note rows to be written with this statement."""
        self.changes.writes.setdefault(statement, []).extend(rows)

    def write_many(self, statement: sa.Executable, rows: Rows) -> None:
        """Note rows too many to hold; such a unit is committed alone."""
        self.changes.bulk.append((statement, rows))

    def rely_on_user(self, user: str, version: int) -> None:
        """Write only if the user is still at this version (0: never seen)."""
        self.changes.users[user] = version

    def rely_on_revision(self, part: str, number: int) -> None:
        """Write only if this part of the revision still stands."""
        self.changes.revision[part] = number

    def pause(self) -> None:
        """Let other requests have their turn in the middle of something long."""
        await_only(asyncio.sleep(0))

    @contextmanager
    def alone(self, lock: asyncio.Lock) -> Iterator[None]:
        """Do something that units of this process would otherwise do in parallel."""
        await_only(lock.acquire())
        try:
            yield
        finally:
            lock.release()

    @property
    def backlog(self) -> float:
        """Seconds after which something long would begin, as far as was foretold."""
        return self._aside.backlog

    def aside(
        self,
        work: Callable[[], T],
        *,
        within: float | None = None,
        foretold: float = 0.0,
    ) -> T:
        """Compute something long without holding up other requests.

        within:   seconds to wait for it
        foretold: seconds that it may take

        Raises:
            Late: it was not there within so many seconds.
        """
        return self._aside.run(work, within=within, foretold=foretold)

    def in_turn(self, work: Callable[[], T]) -> T:
        """Compute what takes seconds, one after the other: nobody listens for it."""
        return self._in_turn.run(work)


def chunks(rows: Iterable[Params], size: int = 1000) -> Iterator[list[Params]]:
    """Rows in lists of at most this many."""
    chunk: list[Params] = []
    for row in rows:
        chunk.append(row)
        if len(chunk) == size:
            yield chunk
            chunk = []
    if chunk:
        yield chunk
