"""The faults: each is done as often as one likes, and tells what came of it."""

import asyncio
import os
import resource
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path

import asyncpg
import time_machine

import app
from app.settings import Settings
from app.storage import migrate
from tests.app.postgres import free_port
from tests.app.service import ADMIN, Service, client_of
from tests.catalogues import load, paper_example
from tests.faults.encore import Encore, serving
from tests.faults.listeners import listening
from tests.faults.outcome import Outcome, outcome
from tests.faults.postgres import durable, replicated

USERS = 8
LOCKED_S = 7.0  # longer than anybody waits for a connection
FULL_S = 1.5
NO_LIMIT = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
MIGRATION = '''"""A release that has not been written yet."""

import sqlalchemy as sa
from alembic import op

revision = "9999"
down_revision = "{head}"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for table in ("users", "plays", "models", "policies", "revision"):
        op.add_column(table, sa.Column("novelty", sa.Text(), nullable=True))
    op.create_index("ix_plays_novelty", "plays", ["novelty"])


def downgrade() -> None:
    op.drop_index("ix_plays_novelty", "plays")
    for table in ("users", "plays", "models", "policies", "revision"):
        op.drop_column(table, "novelty")
'''


def workers_killed(rounds: int, _folder: Path) -> Outcome:
    """One of three workers is killed (-9), again and again."""
    with durable() as server, serving(server.url("encore"), workers=3) as encore:
        with listening([encore.url], USERS) as told:
            recovered = []
            for number in range(rounds):
                told.recovered(time.monotonic())
                killed = time.monotonic()
                encore.kill_worker(number)
                recovered.append(told.recovered(killed))
                encore.wait_for_workers()
        return outcome(
            "kill -9 of a worker", encore.url, encore.database_url, told, recovered
        )


def service_killed(rounds: int, folder: Path) -> Outcome:
    """The only process is killed (-9) and started again, on SQLite."""
    with serving(_sqlite(folder)) as encore:
        with listening([encore.url], USERS) as told:
            recovered = []
            for _ in range(rounds):
                told.recovered(time.monotonic())
                encore.kill()
                killed = time.monotonic()
                encore.start()
                recovered.append(told.recovered(killed))
        return outcome(
            "kill -9 of the service (SQLite)",
            encore.url,
            encore.database_url,
            told,
            recovered,
        )


def postgres_killed(rounds: int, _folder: Path) -> Outcome:
    """All processes of PostgreSQL are killed (-9), and it is started again."""
    with durable() as server, serving(server.url("encore"), workers=2) as encore:
        with listening([encore.url], USERS) as told:
            recovered = []
            for _ in range(rounds):
                told.recovered(time.monotonic())
                server.kill()
                killed = time.monotonic()
                server.start()
                recovered.append(told.recovered(killed))
        return outcome(
            "kill -9 of PostgreSQL", encore.url, encore.database_url, told, recovered
        )


def primary_lost(rounds: int, _folder: Path) -> Outcome:
    """The primary is killed, and its synchronous replica takes over."""
    found = []
    for _ in range(rounds):
        with replicated() as (primary, standby):
            hosts = "&".join(f"host=127.0.0.1:{s.port}" for s in (primary, standby))
            url = f"postgresql://postgres@/encore?{hosts}&target_session_attrs=primary"
            with serving(url, workers=2) as encore:
                with listening([encore.url], USERS) as told:
                    told.recovered(time.monotonic())
                    primary.kill()
                    killed = time.monotonic()
                    standby.promote()
                    recovered = [told.recovered(killed)]
                    time.sleep(0.5)
                found.append(
                    outcome("failover to a replica", encore.url, url, told, recovered)
                )
    return _together(found)


def disk_full(rounds: int, folder: Path) -> Outcome:
    """No file can be written to for a while, on SQLite; then it can again."""
    with serving(_sqlite(folder)) as encore:
        with listening([encore.url], USERS) as told:
            recovered = []
            for _ in range(rounds):
                told.recovered(time.monotonic())
                with _full(encore):
                    time.sleep(FULL_S)
                freed = time.monotonic()
                recovered.append(told.recovered(freed))
        assert any(error.startswith("503") for error in told.errors), told.errors
        return outcome(
            "disk full (SQLite)", encore.url, encore.database_url, told, recovered
        )


def pool_exhausted(rounds: int, _folder: Path) -> Outcome:
    """Each connection to PostgreSQL waits for a lock that somebody holds."""
    few = {"ENCORE_POOL_SIZE": "2"}
    with durable() as server, serving(server.url("encore"), extra=few) as encore:
        with listening([encore.url], USERS) as told:
            recovered = []
            for _ in range(rounds):
                told.recovered(time.monotonic())
                asyncio.run(_locked(server.url("encore")))
                freed = time.monotonic()
                recovered.append(told.recovered(freed))
        assert any(error.startswith("503") for error in told.errors), told.errors
        return outcome(
            "connection pool exhausted",
            encore.url,
            encore.database_url,
            told,
            recovered,
        )


def clock_moved_back(rounds: int, folder: Path) -> Outcome:
    """The clock jumps back by a day, and forward again, while slots follow it."""
    url = _sqlite(folder)
    service = Service.start(
        Settings(database_url=url, port=0, bootstrap_key=ADMIN, log_level="error")
    )
    try:
        load(service.client, paper_example(2))
        service.client.put("/v1/admin/clock", json={"slot_s": 3600})
        with listening([service.url], USERS) as told:
            recovered = []
            for _ in range(rounds):
                told.recovered(time.monotonic())
                moved = time.monotonic()
                back = datetime.now().astimezone() - timedelta(days=1)
                with time_machine.travel(back, tick=True):
                    recovered.append(told.recovered(time.monotonic()))
                    time.sleep(0.3)
                assert time.monotonic() > moved
        return outcome("clock moved back a day", service.url, url, told, recovered)
    finally:
        service.stop()


def rolling_upgrade(rounds: int, folder: Path) -> Outcome:
    """A later release migrates, and serves beside this one, which then ends."""
    return _together(
        [_upgraded(_later_release(folder / f"later-{n}")) for n in range(rounds)]
    )


FAULTS: Mapping[str, Callable[[int, Path], Outcome]] = {
    fault.__name__: fault
    for fault in (
        workers_killed,
        service_killed,
        postgres_killed,
        primary_lost,
        disk_full,
        pool_exhausted,
        clock_moved_back,
        rolling_upgrade,
    )
}


def _upgraded(later: Path) -> Outcome:
    with durable() as server, serving(server.url("encore")) as old:
        with client_of(old.url, ADMIN) as client:  # what compiles fast
            client.put("/v1/admin/policy", json={"name": "myopic"}).raise_for_status()
        port = free_port()
        with listening([old.url, f"http://127.0.0.1:{port}"], USERS) as told:
            told.recovered(time.monotonic())
            migrated = time.monotonic()
            _migrate(old.database_url, later)
            recovered = told.recovered(migrated)
            new = Encore(old.database_url, folder=later, port=port)
            try:
                new.wait()
                told.recovered(time.monotonic())
                old.stop()
                told.recovered(time.monotonic())
            except BaseException:
                new.kill()
                raise
        try:
            return outcome(
                "rolling upgrade", new.url, new.database_url, told, [recovered], later
            )
        finally:
            new.stop()


def _migrate(database_url: str, release: Path) -> None:
    command = [sys.executable, "-m", "app.cli", "migrate"]
    surroundings = os.environ | {"ENCORE_DATABASE_URL": database_url}
    subprocess.run(command, env=surroundings, cwd=release, check=True)


def _later_release(folder: Path) -> Path:
    """This release, and a migration that is yet to be written."""
    here = Path(app.__file__).parents[1]
    folder.mkdir(parents=True)
    for package in ("app", "learning", "policies", "simulation"):
        (folder / package).symlink_to(here / package)
    shutil.copytree(here / "migrations", folder / "migrations")
    text = MIGRATION.format(head=migrate.head())
    (folder / "migrations" / "versions" / "9999_later.py").write_text(text)
    return folder


def _sqlite(folder: Path) -> str:
    url = f"sqlite:///{folder / 'encore.db'}"
    migrate.upgrade(url)
    return url


@contextmanager
def _full(encore: Encore) -> Iterator[None]:
    """No file of a process grows beyond its first page."""
    resource.prlimit(encore.process.pid, resource.RLIMIT_FSIZE, (4096, NO_LIMIT[1]))
    try:
        yield
    finally:
        resource.prlimit(encore.process.pid, resource.RLIMIT_FSIZE, NO_LIMIT)


async def _locked(url: str) -> None:
    connection = await asyncpg.connect(url)
    async with connection.transaction():
        await connection.execute("LOCK TABLE users IN ACCESS EXCLUSIVE MODE")
        await asyncio.sleep(LOCKED_S)
    await connection.close()


def _together(found: Sequence[Outcome]) -> Outcome:
    """The rounds of a fault that began anew each time."""
    errors: Counter[str] = Counter()
    for each in found:
        errors.update(each.errors)
    return Outcome(
        found[0].fault,
        [seconds for each in found for seconds in each.recovered],
        sum(each.acknowledged for each in found),
        sum(each.lost for each in found),
        sum(each.doubled for each in found),
        errors,
        [text for each in found for text in each.wrong],
        [finding for each in found for finding in each.audit],
    )
