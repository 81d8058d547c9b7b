"""A server that ends connections, also those that nobody uses at the moment."""

import asyncio
from collections.abc import Callable

import asyncpg
import sqlalchemy as sa

from app.errors import DatabaseUnavailable
from app.settings import Settings
from app.storage.database import Database
from app.storage.store import Store

ECHO = sa.select(sa.bindparam("said", type_=sa.Integer).label("said"))
END = """SELECT pg_terminate_backend(pid) FROM pg_stat_activity
    WHERE datname = current_database() AND pid <> pg_backend_pid()"""
ROUNDS = 60


def test_reads_are_answered_or_unavailable_while_the_server_ends_connections(
    postgres_url: str,
) -> None:
    answered = asyncio.run(_read_meanwhile(postgres_url))
    assert answered > ROUNDS


async def _read_meanwhile(url: str) -> int:
    """How many reads were answered; any error but an outage is raised."""
    settings = Settings.model_validate({"database_url": url, "pool_size": 5})
    database = Database(settings)
    admin = await asyncpg.connect(url)
    over = asyncio.Event()
    asking = [asyncio.create_task(_ask(database, over)) for _ in range(8)]
    for _ in range(ROUNDS):
        await asyncio.sleep(0.03)
        await admin.execute(END)
    over.set()
    try:
        return sum(await asyncio.gather(*asking))
    finally:
        await admin.close()
        await database.close()


async def _ask(database: Database, over: asyncio.Event) -> int:
    answered = 0
    while not over.is_set():
        try:
            said = await database.run(_echo(answered))
        except DatabaseUnavailable:
            await asyncio.sleep(0)
        else:
            assert said == answered
            answered += 1
    return answered


def _echo(said: int) -> Callable[[Store], int]:
    def work(store: Store) -> int:
        row = store.row(ECHO, {"said": said})
        assert row is not None
        return int(row.said)

    return work
