"""Logs: one line of JSON a request, and nothing that was not meant for them."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest

from tests.app.postgres import free_port
from tests.app.service import ADMIN

ROOT = Path(__file__).parents[2]
SERVE = """
import uvicorn
from app.main import create_app
from app.settings import Settings

settings = Settings()
uvicorn.run(create_app(settings), port=settings.port, log_config=None, access_log=False)
"""


class Process:
    """A service in a process of its own, and what it writes."""

    def __init__(self, database_url: str) -> None:
        self.url = f"http://127.0.0.1:{free_port()}"
        surroundings = os.environ | {
            "ENCORE_DATABASE_URL": database_url,
            "ENCORE_PORT": self.url.rpartition(":")[2],
            "ENCORE_BOOTSTRAP_KEY": ADMIN,
            "ENCORE_LOG_LEVEL": "debug",
            "PYTHONPATH": str(ROOT),
        }
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVE],
            env=surroundings,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._wait()

    def _wait(self) -> None:
        end = time.monotonic() + 60
        while time.monotonic() < end and self._process.poll() is None:
            try:
                httpx.get(f"{self.url}/health/live")
            except httpx.ConnectError:
                time.sleep(0.05)
            else:
                return
        raise RuntimeError("the service did not start")

    def stop(self) -> str:
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        output, _ = self._process.communicate(timeout=60)
        return output


@pytest.fixture
def process(sqlite_url: str) -> Iterator[Process]:
    running = Process(sqlite_url)
    yield running
    running.stop()


def test_each_request_is_a_line_of_json_with_its_names(process: Process) -> None:
    address = urlsplit(process.url)
    headers = {"Authorization": f"Bearer {ADMIN}"}
    with httpx.Client(base_url=process.url, headers=headers) as client:
        client.get("/v1/users/ann/next", headers={"X-Request-ID": "first"})
        client.get("/v1/users/a%0Ab%22%7D/next", headers={"X-Request-ID": "second"})
        forged = client.get("/v1/users/ann/next?forged=%0A%7B%7D")
        client.get("/v1/plays/not-a-play", headers={"X-Request-ID": "third"})
        form = {"scope": "serve", "name": "x"}
        secret = client.post("/v1/admin/keys", json=form).json()["key"]
        client.delete(f"/v1/admin/keys/{secret}")
        client.get(f"/nowhere/{secret}")
        client.get("/v1/items", headers={"Authorization": f"Bearer {secret}"})
    with socket.create_connection((address.hostname, address.port)) as connection:
        connection.sendall(b"no request at all\r\n\r\n")
        connection.makefile("rb").read()

    output = process.stop()
    lines = [json.loads(line) for line in output.splitlines()]

    by_id: dict[str, dict[str, Any]] = {
        line["request_id"]: line for line in lines if line["event"] == "request"
    }
    first = by_id["first"]
    assert first["user"] == "ann"
    assert (first["method"], first["status"]) == ("GET", 409)
    assert first["route"] == "/v1/users/{user}/next"
    assert first["ms"] > 0
    assert by_id["second"]["user"] == 'a\nb"}'
    assert by_id["third"]["play"] == "not-a-play"
    assert by_id[forged.headers["x-request-id"]]["user"] == "ann"
    assert any(line["event"] == "Invalid HTTP request received." for line in lines)
    assert ADMIN not in output
    assert secret not in output
