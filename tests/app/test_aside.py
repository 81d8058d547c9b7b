"""Long computations: beside other requests, and not without limit."""

import asyncio
import threading

import pytest
from sqlalchemy.util import greenlet_spawn

from app.errors import Overloaded
from app.settings import Settings
from app.storage.aside import Aside
from app.storage.database import TURNS, Database


def test_what_would_wait_too_long_is_refused() -> None:
    async def work() -> None:
        aside, release = Aside(threads=1, most=2), threading.Event()
        taken = [
            asyncio.create_task(greenlet_spawn(aside.run, release.wait))
            for _ in range(2)
        ]
        await asyncio.sleep(0)

        with pytest.raises(Overloaded):
            await greenlet_spawn(aside.run, release.wait)

        release.set()
        assert await asyncio.gather(*taken) == [True, True]
        assert await greenlet_spawn(aside.run, lambda: "again") == "again"
        aside.close()

    asyncio.run(work())


def test_an_error_aside_is_the_error_of_the_unit() -> None:
    async def work() -> None:
        aside = Aside(threads=1, most=1)
        with pytest.raises(ZeroDivisionError):
            await greenlet_spawn(aside.run, lambda: 1 // 0)
        assert await greenlet_spawn(aside.run, lambda: "again") == "again"
        aside.close()

    asyncio.run(work())


def test_what_is_done_in_turn_holds_nothing_else_up(settings: Settings) -> None:
    async def work() -> None:
        database, release = Database(settings), threading.Event()
        blocked = [
            asyncio.create_task(
                database.run(lambda store: store.in_turn(lambda: release.wait(60)))
            )
            for _ in range(TURNS)
        ]
        await asyncio.sleep(0)

        await database.run(lambda store: store.aside(release.set))

        assert await asyncio.gather(*blocked) == [True] * TURNS
        await database.close()

    asyncio.run(work())
