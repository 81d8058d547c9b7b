"""The revisions lead to the tables, and back."""

import asyncio
from functools import partial
from typing import Any

import asyncpg
import pytest
from alembic import command
from alembic.config import Config

from app.settings import Settings
from app.storage import migrate
from app.storage.tables import metadata
from tests.app.clocks import later, set_clock
from tests.app.commands import Encore, Said
from tests.app.service import Service
from tests.app.test_audits import audit
from tests.catalogues import SERIES, load, paper_example
from tests.filter import after_play, reward


def test_the_revisions_lead_to_the_tables_of_the_code(database_url: str) -> None:
    url = Settings(database_url=database_url).database_url

    command.check(migrate.config(url))


def test_they_lead_down_and_up_again(database_url: str) -> None:
    url = Settings(database_url=database_url).database_url

    migrate.downgrade(url, "base")
    migrate.upgrade(url)

    command.check(migrate.config(url))


def test_answers_that_an_earlier_release_cannot_read_go_with_their_models(
    settings: Settings,
) -> None:
    """A model of signals is left with the reward that it expects of a play."""
    partial = {"item": "pilot", "signal": "partial"}
    service = Service.start(settings)
    service.put_model("series", SERIES)
    service.put_item("pilot", "series")
    service.client.post("/v1/users/ann/plays", json=partial).raise_for_status()
    service.stop()

    migrate.downgrade(settings.database_url, "0001")
    migrate.upgrade(settings.database_url)

    service = Service.start(settings)
    model = service.client.get("/v1/models/series").json()
    [play] = service.client.get("/v1/users/ann/plays").json()["plays"]
    [held] = service.beliefs("ann")["beliefs"]
    service.stop()
    assert model["signals"] == ["skip", "like"]
    assert model["like"] == pytest.approx(reward(SERIES), abs=1e-12)
    assert play["signal"] == "none"
    unanswered = after_play(SERIES, SERIES["prior"], "none")
    assert held["belief"] == pytest.approx(unanswered, abs=1e-12)


def test_plays_that_shared_a_slot_have_one_each_after_a_downgrade(
    settings: Settings,
) -> None:
    service = Service.start(settings)
    load(service.client, paper_example(2))
    for user in ("ann", "bob"):
        for play in service.next(user, count=3)["plays"]:
            service.answer(play["play"], "like")
        service.answer(service.next(user, count=3)["plays"][1]["play"], "skip")
        service.client.post(
            f"/v1/users/{user}/plays", json={"item": "item-1", "signal": "like"}
        )
    waiting = service.next("ann")["plays"]
    service.answer(service.next("cat")["play"], "like")
    service.stop()

    migrate.downgrade(settings.database_url, "0002")
    migrate.upgrade(settings.database_url)

    service = Service.start(settings)
    plays = service.client.get("/v1/users/ann/plays").json()["plays"]
    assert [play["slot"] for play in plays] == [4, 3, 2, 1, 0]
    assert [play["decided_slot"] for play in plays] == [4, 3, 0, 0, 0]
    assert service.next("ann")["play"] == waiting[0]["play"]
    assert service.answer(waiting[0]["play"], "like")["slot"] == 6
    assert service.beliefs("cat")["slot"] == 1
    assert [one.findings for one in audit(service)] == [[], [], []]
    assert [one.stale for one in audit(service)] == [False, True, False]
    service.stop()


def test_slots_that_followed_a_clock_are_counted_by_plays_after_a_downgrade(
    settings: Settings,
) -> None:
    service = Service.start(settings)
    load(service.client, paper_example(2))
    set_clock(service, 60.0)
    service.answer(service.next("bob")["play"], "like")
    for _ in range(3):
        slate = service.next("ann", count=2)["plays"]
        for play in slate:
            service.answer(play["play"], "like")
        later(service, "ann", 86_400.0)
    waiting = service.next("ann", count=2)["plays"]
    service.answer(waiting[1]["play"], "skip")
    service.stop()

    migrate.downgrade(settings.database_url, "0006")
    migrate.upgrade(settings.database_url)

    service = Service.start(settings)
    plays = service.client.get("/v1/users/ann/plays").json()["plays"]
    assert service.client.get("/v1/admin/clock").json()["slot_s"] is None
    assert [play["slot"] for play in plays] == [3, 2, 2, 1, 1, 0, 0]
    assert [play["decided_slot"] for play in plays] == [3, 2, 2, 1, 1, 0, 0]
    assert [one.findings for one in audit(service)] == [[], []]
    assert service.answer(waiting[0]["play"], "like")["slot"] == 4
    assert [one.findings for one in audit(service)] == [[], []]
    service.stop()


def test_every_table_of_a_user_is_keyed_by_the_user_first() -> None:
    for table in metadata.tables.values():
        if "user_id" in table.columns:
            first = next(iter(table.primary_key.columns))
            assert first.name == "user_id", table.name


CITUS = """
CREATE TABLE distributed (name text, by_column text);
CREATE FUNCTION create_distributed_table(name text, by_column text,
    colocate_with text DEFAULT NULL) RETURNS void LANGUAGE sql
    AS 'INSERT INTO distributed VALUES (name, by_column)';
CREATE FUNCTION create_reference_table(name text) RETURNS void LANGUAGE sql
    AS 'INSERT INTO distributed VALUES (name, NULL)';
"""
ALONE = """
SELECT i.indexrelid::regclass::text FROM pg_index i
    JOIN distributed d ON d.name::regclass = i.indrelid
    WHERE d.by_column IS NOT NULL AND i.indisunique AND (
        SELECT a.attname FROM pg_attribute a
        WHERE a.attrelid = i.indrelid AND a.attnum = i.indkey[0]) <> d.by_column
"""


async def on_postgresql(url: str, *scripts: str) -> list[Any]:
    connection = await asyncpg.connect(url)
    for script in scripts[:-1]:
        await connection.execute(script)
    found = [row[0] for row in await connection.fetch(scripts[-1])]
    await connection.close()
    return found


def test_requests_come_before_a_migration(
    postgres_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that holds what the other wants next: the migration lets go, and is back."""
    url = Settings(database_url=postgres_url).database_url
    begun: list[object] = []
    really = command.upgrade

    def upgrade(config: Config, to: str) -> None:
        begun.append(to)
        really(config, to)

    monkeypatch.setattr(command, "upgrade", upgrade)
    address = url.replace("+asyncpg", "")
    migrate.downgrade(url, "0013")

    async def request() -> None:
        connection = await asyncpg.connect(address)
        waiting = "SELECT count(*) FROM pg_locks WHERE NOT granted"
        async with connection.transaction():
            await connection.execute("SELECT FROM plays LIMIT 1")
            upgrade = asyncio.create_task(asyncio.to_thread(migrate.upgrade, url))
            while not (await on_postgresql(address, waiting))[0]:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
            await connection.execute("SELECT FROM policies LIMIT 1")
        await upgrade
        await connection.close()

    asyncio.run(request())

    assert begun == ["head", "head"]
    command.check(migrate.config(url))


def test_a_migration_that_never_has_its_turn_changes_nothing(
    postgres_url: str, encore: Encore, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = Settings(database_url=postgres_url).database_url
    migrate.downgrade(url, "0013")
    monkeypatch.setattr(migrate, "ATTEMPTS", 1)

    async def held() -> Said:
        connection = await asyncpg.connect(url.replace("+asyncpg", ""))
        async with connection.transaction():
            await connection.execute("SELECT FROM plays LIMIT 1")
            asked = partial(encore, "migrate", "--database-url", postgres_url)
            said = await asyncio.to_thread(asked)
        await connection.close()
        return said

    said = asyncio.run(held())

    assert said.status == 1
    assert "Nothing was changed; try again." in said.err
    assert "Traceback" not in said.err
    migrate.upgrade(url)
    command.check(migrate.config(url))


def test_plays_are_shared_out_by_user_on_postgresql(example: Service) -> None:
    users = [f"user-{number}" for number in range(40)]
    plays = [example.next(user)["play"] for user in users]
    for play in plays:
        example.answer(play, "like")
    if example.settings.on_sqlite:
        return
    url = example.settings.database_url.replace("+asyncpg", "")

    held = asyncio.run(
        on_postgresql(url, "SELECT count(*) FROM plays GROUP BY tableoid")
    )

    assert sum(held) == len(plays)
    assert len(held) == 8


def test_tables_can_be_distributed_by_user(
    encore: Encore, postgres_url: str, settings: Settings
) -> None:
    """PostgreSQL checks the SQL; what Citus would do is written down."""
    printed = encore("migrate", "--citus").out
    changed = settings.with_changes(database_url=postgres_url)
    before = Service.start(changed)
    load(before.client, paper_example(2))
    before.answer(before.next("ann")["play"], "like")
    before.stop()

    found = asyncio.run(on_postgresql(postgres_url, CITUS, printed, ALONE))

    assert found == []
    by_user = asyncio.run(
        on_postgresql(
            postgres_url, "SELECT name FROM distributed WHERE by_column IS NOT NULL"
        )
    )
    everything = asyncio.run(
        on_postgresql(postgres_url, "SELECT name FROM distributed")
    )
    keyed = {table.name for table in metadata.tables.values() if "user_id" in table.c}
    assert by_user == ["users", "beliefs", "plays", "arm_users"]
    assert {*by_user} == keyed | {"users"}
    assert sorted(everything) == sorted(table.name for table in metadata.sorted_tables)
    after = Service.start(changed)
    after.answer(after.next("ann")["play"], "skip")
    told = after.client.get("/v1/users/ann/plays").json()["plays"]
    assert [play["signal"] for play in told] == ["skip", "like"]
    [audited] = audit(after)
    assert audited.findings == []
    after.stop()
