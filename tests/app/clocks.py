"""Time that passes for the users of a running service."""

import asyncio
from collections.abc import Awaitable, Callable
from datetime import timedelta
from typing import TypeVar

import sqlalchemy as sa

from app.storage.database import Database
from app.storage.store import Store
from app.storage.tables import plays, users
from tests.app.service import Service

T = TypeVar("T")

USER = sa.select(users).where(users.c.id == sa.bindparam("user"))
PLAYS = sa.select(plays).where(plays.c.user_id == sa.bindparam("user"))
SET_USER = (
    users.update()
    .where(users.c.id == sa.bindparam("user"))
    .values(began=sa.bindparam("to_began"), last_seen=sa.bindparam("to_last_seen"))
)
SET_PLAY = (
    plays.update()
    .where(plays.c.user_id == sa.bindparam("user"), plays.c.id == sa.bindparam("play"))
    .values(created_at=sa.bindparam("to_created"), answered_at=sa.bindparam("to_told"))
)


def set_clock(service: Service, slot_s: float | None) -> None:
    """Let slots follow a clock, or none."""
    if slot_s is None:
        answer = service.client.delete("/v1/admin/clock")
    else:
        answer = service.client.put("/v1/admin/clock", json={"slot_s": slot_s})
    assert answer.is_success, answer.text


def later(service: Service, user: str, seconds: float) -> None:
    """Let time pass for a user: all that has happened, happened so much earlier."""
    ago = timedelta(seconds=seconds)

    def pass_time(store: Store) -> None:
        row = store.row(USER, {"user": user})
        assert row is not None
        moved = {
            "user": user,
            "to_began": row.began - ago // timedelta(milliseconds=1),
            "to_last_seen": row.last_seen - ago,
        }
        store.write(SET_USER, moved)
        for play in store.rows(PLAYS, {"user": user}):
            told = None if play.answered_at is None else play.answered_at - ago
            times = {"to_created": play.created_at - ago, "to_told": told}
            store.write(SET_PLAY, {"user": user, "play": play.id, **times})

    with_database(service, lambda database: database.run(pass_time))


def with_database(service: Service, work: Callable[[Database], Awaitable[T]]) -> T:
    async def run() -> T:
        database = Database(service.settings)
        try:
            return await work(database)
        finally:
            await database.close()

    return asyncio.run(run())
