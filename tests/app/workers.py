"""The service in processes of its own, as `encore serve` starts it."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from tests.app.postgres import die_with_parent, free_port
from tests.app.service import ADMIN, client_of


@dataclass(frozen=True)
class Serving:
    """`encore serve`, and a client that may do everything."""

    client: httpx.Client
    process: "subprocess.Popen[bytes]"

    def workers(self) -> list[int]:
        """Process ids of the workers, each of which holds its number."""
        return sorted(
            int(pid)
            for task in Path(f"/proc/{self.process.pid}/task").iterdir()
            for pid in (task / "children").read_text().split()
            if "spawn_main" in Path(f"/proc/{pid}/cmdline").read_text()
        )

    def shared(self) -> Path:
        """Where the workers count."""
        environment = Path(f"/proc/{self.workers()[0]}/environ").read_text()
        named = dict(entry.split("=", 1) for entry in environment.split("\0") if entry)
        return Path(named["PROMETHEUS_MULTIPROC_DIR"])


@contextmanager
def served(
    database_url: str,
    *,
    workers: int = 1,
    extra: Mapping[str, str] | None = None,
    log: Path | None = None,
) -> Iterator[httpx.Client]:
    """A client of `encore serve` with this many workers; stopped at the end.

    log: a file for what it writes
    """
    with serving(database_url, workers=workers, extra=extra, log=log) as running:
        yield running.client


@contextmanager
def serving(
    database_url: str,
    *,
    workers: int = 1,
    extra: Mapping[str, str] | None = None,
    log: Path | None = None,
) -> Iterator[Serving]:
    """The same, with the process itself."""
    port = free_port()
    environment = os.environ | {
        "ENCORE_DATABASE_URL": database_url,
        "ENCORE_BOOTSTRAP_KEY": ADMIN,
        "ENCORE_LOG_LEVEL": "error",
        "ENCORE_INDEX_TABLES": "off",
        "ENCORE_DECISION_BUDGET": "60000",
        **(extra or {}),
    }
    command = [sys.executable, "-m", "app.cli", "serve"]
    with nullcontext() if log is None else log.open("wb") as out:
        process = subprocess.Popen(
            [*command, "--port", str(port), "--workers", str(workers)],
            env=environment,
            stdout=out,
            stderr=None if out is None else subprocess.STDOUT,
            preexec_fn=die_with_parent,  # noqa: PLW1509 - no threads run in the child
        )
    client = client_of(f"http://127.0.0.1:{port}", ADMIN)
    try:
        wait_until_ready(client, process)
        yield Serving(client, process)
    finally:
        client.close()
        process.terminate()
        process.wait(30)


def wait_until_ready(client: httpx.Client, process: "subprocess.Popen[Any]") -> None:
    end = time.monotonic() + 120
    while time.monotonic() < end:
        if process.poll() is not None:
            raise RuntimeError(f"the service ended with {process.returncode}")
        try:
            if client.get("/health/ready").status_code == 200:
                return
        except httpx.TransportError:
            pass
        time.sleep(0.05)
    raise TimeoutError("the service was not ready in time")
