"""Encore in processes that can be killed."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx

from tests.app.indexes import metric
from tests.app.postgres import die_with_parent, free_port
from tests.app.service import ADMIN, client_of
from tests.app.workers import wait_until_ready
from tests.catalogues import load, paper_example


class Encore:
    """`encore serve`, by a supervisor: the same port again after each death."""

    def __init__(
        self,
        database_url: str,
        *,
        workers: int = 1,
        folder: Path | None = None,
        port: int | None = None,
        extra: Mapping[str, str] | None = None,
    ) -> None:
        """`folder`: where the code is, None: here."""
        self.database_url = database_url
        self.port = port or free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._folder = folder
        self._workers = workers
        self._environment = os.environ | {
            "ENCORE_DATABASE_URL": database_url,
            "ENCORE_BOOTSTRAP_KEY": ADMIN,
            "ENCORE_LOG_LEVEL": "error",
            "ENCORE_INDEX_TABLES": "off",
            **(extra or {}),
        }
        self.start()

    def start(self) -> None:
        command = [sys.executable, "-m", "app.cli", "serve", "--port", str(self.port)]
        self.process = subprocess.Popen(
            [*command, "--workers", str(self._workers)],
            env=self._environment,
            cwd=self._folder,
            preexec_fn=die_with_parent,  # noqa: PLW1509 - no threads run in the child
        )

    def wait(self) -> None:
        with client_of(self.url, ADMIN) as client:
            wait_until_ready(client, self.process)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def workers(self) -> Sequence[int]:
        """Process ids of the workers."""
        return [
            int(entry.name)
            for entry in Path("/proc").iterdir()
            if entry.name.isdecimal() and self._is_worker(entry)
        ]

    def kill_worker(self, number: int) -> int:
        present = sorted(self.workers())
        killed = present[number % len(present)]
        os.kill(killed, signal.SIGKILL)
        return killed

    def wait_for_workers(self) -> None:
        """Wait until all of them can decide: else the next fault meets a service that
        is still starting.
        """
        end = time.monotonic() + 120
        while self._ready() < self._workers:
            if time.monotonic() > end:
                raise TimeoutError("the workers did not come back")
            time.sleep(0.05)

    def _ready(self) -> float:
        with client_of(self.url, ADMIN) as client:
            try:
                return metric(client, "encore_workers_ready")
            except httpx.TransportError:
                return 0.0  # the one that was asked is dead

    def stop(self) -> None:
        self.process.terminate()
        self.process.wait(60)

    def _is_worker(self, entry: Path) -> bool:
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            return (
                parent == self.process.pid
                and b"spawn_main" in (entry / "cmdline").read_bytes()
            )
        except (OSError, ValueError):
            return False


@contextmanager
def serving(
    database_url: str,
    *,
    workers: int = 1,
    folder: Path | None = None,
    extra: Mapping[str, str] | None = None,
) -> Iterator[Encore]:
    """A service with the paper's example 2 and the default policy."""
    encore = Encore(database_url, workers=workers, folder=folder, extra=extra)
    try:
        encore.wait()
        with client_of(encore.url, ADMIN) as client:
            load(client, paper_example(2))
        yield encore
    finally:
        encore.stop()
