"""The door to the database: group commit, compare and set, and a full queue."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime
from functools import partial

import pytest
import sqlalchemy as sa

from app.domain import User
from app.errors import Contended, DatabaseUnavailable, Overloaded
from app.settings import Settings
from app.storage import users
from app.storage.database import Database
from app.storage.store import Changes, Store
from app.storage.tables import users as users_table
from app.storage.writer import Writer

COUNT = sa.select(sa.func.count()).select_from(users_table)
BREAK = sa.text(
    "INSERT INTO revision (id, catalogue, epoch, policy) VALUES (:id, 0, 0, 0)"
)


def _move(store: Store, user: User, slot: int) -> None:
    at = datetime.now(UTC)
    users.move(store, user, slot=slot, pending=None, at=at, anchor=user.anchor)


def step(store: Store, user: str) -> int:
    """Move a user on by one slot."""
    _, standing = users.by_id(store, user)
    _move(store, standing, standing.slot + 1)
    return standing.slot


def slot_of(store: Store, user: str) -> int:
    return users.by_id(store, user)[1].slot


def test_no_step_is_lost_where_many_are_taken_at_once(database_url: str) -> None:
    async def work(database: Database) -> None:
        steps = await asyncio.gather(
            *(database.run(partial(step, user=f"user-{n % 4}")) for n in range(64))
        )
        assert sorted(steps) == sorted(list(range(16)) * 4)
        for user in range(4):
            assert await database.run(partial(slot_of, user=f"user-{user}")) == 16

    run(database_url, work)


def test_a_failing_unit_harms_none_of_its_batch(database_url: str) -> None:
    def fail(store: Store) -> None:
        step(store, "unlucky")
        store.write(BREAK, {"id": 2})

    async def work(database: Database) -> None:
        results = await asyncio.gather(
            *(database.run(partial(step, user=f"user-{n}")) for n in range(8)),
            database.run(fail),
            *(database.run(partial(step, user=f"user-{n}")) for n in range(8, 16)),
            return_exceptions=True,
        )
        failed = [result for result in results if isinstance(result, Exception)]
        assert [type(error) for error in failed] == [sa.exc.IntegrityError]
        row = await database.run(lambda store: store.row(COUNT))
        assert row is not None
        assert row[0] == 16
        assert await database.run(partial(slot_of, user="unlucky")) == 0

    run(database_url, work)


def test_a_unit_that_always_loses_gives_up(database_url: str) -> None:
    def lose(store: Store) -> None:
        _move(store, User("ann", version=7), 1)

    async def work(database: Database) -> None:
        with pytest.raises(Contended):
            await database.run(lose)

    run(database_url, work)


def test_a_batch_is_committed_as_one() -> None:
    async def work() -> None:
        batches: list[int] = []
        release = asyncio.Event()

        async def apply(batch: Sequence[Changes]) -> list[bool]:
            await release.wait()
            batches.append(len(batch))
            return [True] * len(batch)

        writer = Writer(apply, limit=100, side_door=False)
        waiting = [asyncio.create_task(writer.commit(Changes())) for _ in range(10)]
        await asyncio.sleep(0)
        release.set()
        assert await asyncio.gather(*waiting) == [True] * 10
        assert batches == [10]

    asyncio.run(work())


def test_a_full_queue_refuses_what_is_new_and_keeps_what_waits() -> None:
    async def work() -> None:
        release = asyncio.Event()

        async def apply(batch: Sequence[Changes]) -> list[bool]:
            await release.wait()
            return [True] * len(batch)

        writer = Writer(apply, limit=3, side_door=False)
        waiting = [asyncio.create_task(writer.commit(Changes())) for _ in range(3)]
        await asyncio.sleep(0)
        first_batch_is_out = len(waiting)
        more = [asyncio.create_task(writer.commit(Changes())) for _ in range(3)]
        await asyncio.sleep(0)
        with pytest.raises(Overloaded):
            await writer.commit(Changes())
        release.set()
        assert await asyncio.gather(*waiting, *more) == [True] * (
            first_batch_is_out + 3
        )

    asyncio.run(work())


def test_a_database_that_is_not_there_is_told_apart() -> None:
    async def work(database: Database) -> None:
        with pytest.raises(DatabaseUnavailable):
            await database.run(partial(slot_of, user="ann"))

    run("postgresql://nobody@127.0.0.1:1/none", work)


def run(database_url: str, work: Callable[[Database], Awaitable[None]]) -> None:
    async def opened() -> None:
        database = Database(Settings(database_url=database_url))
        try:
            await work(database)
        finally:
            await database.close()

    asyncio.run(opened())
