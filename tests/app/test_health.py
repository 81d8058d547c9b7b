"""Whether a service can serve, and why not: told to those who send it requests."""

import asyncio
import subprocess
import time
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from app.settings import Settings
from app.storage import migrate
from app.storage.database import Database
from tests.app.commands import start
from tests.app.indexes import metric
from tests.app.postgres import free_port
from tests.app.service import ADMIN, Service, client_of
from tests.app.workers import serving
from tests.catalogues import load, paper_example

LATER = sa.text("UPDATE alembic_version SET version_num = 'of-a-later-release'")


def readiness(service: Service) -> tuple[int, dict[str, Any]]:
    answer = httpx.get(f"{service.url}/health/ready")
    told: dict[str, Any] = answer.json()
    return answer.status_code, told


def ready(service: Service) -> None:
    end = time.monotonic() + 60
    while readiness(service)[0] != 200:
        assert time.monotonic() < end
        time.sleep(0.02)


def move_on(settings: Settings) -> None:
    """Make the tables those of a release that is not known here."""

    async def work() -> None:
        database = Database(settings)
        await database.run(lambda store: store.write(LATER, {}))
        await database.close()

    asyncio.run(work())


def test_it_is_ready_once_nothing_is_missing(service: Service) -> None:
    ready(service)

    assert readiness(service) == (
        200,
        {
            "status": "ready",
            "warm": True,
            "database": True,
            "migrated": True,
            "reasons": [],
        },
    )
    assert metric(service.client, "encore_workers_ready") == 1


def test_it_is_not_ready_while_tables_are_missing(service: Service) -> None:
    ready(service)
    url = service.settings.database_url
    migrate.downgrade(url, "-1")

    status, told = readiness(service)

    [reason] = told["reasons"]
    assert (status, told["status"]) == (503, "not ready")
    assert (told["warm"], told["database"], told["migrated"]) == (True, True, False)
    assert reason["code"] == "migrations_missing"
    there, needed = migrate.known()[1], migrate.head()
    assert f"there: {there}, needed: {needed}" in reason["detail"]

    migrate.upgrade(url)
    assert readiness(service)[0] == 200


def test_it_stays_ready_when_a_later_release_has_added_tables(service: Service) -> None:
    ready(service)
    move_on(service.settings)

    assert readiness(service)[0] == 200


def test_a_release_can_be_started_again_after_a_later_one(
    settings: Settings, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    move_on(settings)
    url = settings.database_url.replace("+asyncpg", "")

    migrated, said_migrate = ended("migrate", "--database-url", url, cwd=tmp_path)
    audited, said_audit = ended("audit", "--database-url", url, cwd=tmp_path)
    with serving(url, extra={"ENCORE_LOG_LEVEL": "warning"}) as running:
        assert running.client.get("/v1/items").status_code == 200

    assert (migrated, audited) == (0, 1)
    assert "left as they are" in said_migrate
    assert "use its `encore`" in said_audit
    assert "the database is of a later release" in capfd.readouterr().out


def ended(*words: str, cwd: Path) -> tuple[int, str]:
    """How a command ended, and what it said."""
    process = start(*words, cwd=cwd)
    _, said = process.communicate()
    return process.returncode, said


def test_a_catalogue_is_read_before_the_first_request(settings: Settings) -> None:
    service = Service.start(settings)
    load(service.client, paper_example(2))
    service.stop()

    service = Service.start(settings)
    ready(service)
    live = service._server.config.app.state.context.live  # type: ignore[union-attr]
    held = len(live._catalogue.listing.shelf)
    service.stop()

    assert held == len(paper_example(2))


def test_it_says_so_while_it_compiles(sqlite_url: str, tmp_path: Path) -> None:
    port = free_port()
    process = start(
        *("serve", "--port", port, "--database-url", sqlite_url),
        cwd=tmp_path,
        extra={"NUMBA_CACHE_DIR": str(tmp_path), "ENCORE_BOOTSTRAP_KEY": ADMIN},
    )
    try:
        with client_of(f"http://127.0.0.1:{port}", ADMIN) as client:
            answer = first_answer(client, process)
            alive = client.get("/health/live")
            counted = metric(client, "encore_workers_ready")
    finally:
        process.kill()
        process.communicate()

    assert answer.status_code == 503
    assert [reason["code"] for reason in answer.json()["reasons"]] == ["warming"]
    assert alive.status_code == 200
    assert counted == 0


def first_answer(
    client: httpx.Client, process: "subprocess.Popen[str]"
) -> httpx.Response:
    while process.poll() is None:
        try:
            return client.get("/health/ready")
        except httpx.ConnectError:
            time.sleep(0.02)
    raise RuntimeError("the service ended")
