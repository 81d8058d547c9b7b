"""The service in processes of its own, as `encore serve` starts it."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import httpx

from tests.app.postgres import die_with_parent, free_port
from tests.app.service import ADMIN, client_of


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
    port = free_port()
    environment = os.environ | {
        "ENCORE_DATABASE_URL": database_url,
        "ENCORE_BOOTSTRAP_KEY": ADMIN,
        "ENCORE_LOG_LEVEL": "error",
        "ENCORE_INDEX_TABLES": "off",
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
        yield client
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
