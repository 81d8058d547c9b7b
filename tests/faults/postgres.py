"""PostgreSQL that keeps what it has acknowledged, and can be killed."""

import asyncio
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import asyncpg

from app.settings import Settings
from app.storage import migrate
from tests.app.postgres import Server

STARTS = 20
DURABLE = ("max_connections=100", "shared_buffers=64MB", "wal_level=replica")


class Durable(Server):
    """A server with full durability."""

    def __init__(self) -> None:
        super().__init__(DURABLE)

    def kill(self) -> None:
        """End it without a word, as a machine does that loses power."""
        self._process.send_signal(signal.SIGSTOP)  # it makes no more of them
        children = self._children()
        self._process.kill()
        self._process.wait()
        for child in children:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)

    def start(self) -> None:
        """Start again, as a supervisor does; it recovers by its log.

        At first it may find processes that are still being ended.
        """
        (self.directory / "data" / "postmaster.pid").unlink(missing_ok=True)
        for left in reversed(range(STARTS)):
            try:
                self._process = self._start()
            except RuntimeError:
                if left == 0:
                    raise
                time.sleep(0.1)
            else:
                return

    def value(self, sql: str, database: str = "postgres") -> object:
        async def fetched() -> object:
            connection = await asyncpg.connect(self.url(database))
            found: object = await connection.fetchval(sql)
            await connection.close()
            return found

        return asyncio.run(fetched())

    def _children(self) -> list[int]:
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdecimal():
                with suppress(OSError):
                    told = (entry / "stat").read_text().rpartition(")")[2].split()
                    if int(told[1]) == self._process.pid:
                        found.append(int(entry.name))
        return found


class Standby(Durable):
    """A streaming replica of another server."""

    def __init__(self, primary: Durable) -> None:
        self._primary = primary
        super().__init__()

    def promote(self) -> None:
        """Take over."""
        self.value("SELECT pg_promote()")

    def _initialise(self) -> None:
        self._run(
            "pg_basebackup",
            *("-D", str(self.directory / "data"), "-R", "-X", "stream"),
            *("-h", "127.0.0.1", "-p", str(self._primary.port), "-U", "postgres"),
            *("--checkpoint=fast", "--no-sync"),
        )
        (self.directory / "data").chmod(0o700)


@contextmanager
def durable() -> Iterator[Durable]:
    """A server with an empty database `encore`, migrated."""
    server = Durable()
    try:
        server.execute("CREATE DATABASE encore")
        migrate.upgrade(Settings(database_url=server.url("encore")).database_url)
        yield server
    finally:
        server.stop()


@contextmanager
def replicated() -> Iterator[tuple[Durable, Standby]]:
    """The same, with a replica that has all before a commit is acknowledged."""
    with durable() as primary:
        standby = Standby(primary)
        try:
            primary.execute("ALTER SYSTEM SET synchronous_standby_names = '*'")
            primary.execute("SELECT pg_reload_conf()")
            state = "SELECT sync_state FROM pg_stat_replication"
            end = time.monotonic() + 30
            while primary.value(state) != "sync":
                if time.monotonic() > end:
                    raise TimeoutError("the replica is not in step")
                time.sleep(0.05)
            yield primary, standby
        finally:
            standby.stop()
