"""Pairs of next and feedback over HTTP: Encore against the yardstick, in one run.

    python -m benchmarks.throughput [--seconds 3] [--rounds 5] [--connections 16]

The server has one core, the load the other. Every variant runs once in each round, and
what is compared is the median of the ratios within a round: machines drift.
"""

import argparse
import asyncio
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from benchmarks.machine import describe
from tests.catalogues import load, paper_example

KEY = "a-key-for-the-benchmark"
USERS = 1000
HERE = Path(__file__).parent.parent


def encore(folder: Path, port: int) -> subprocess.Popen[bytes]:
    environment = os.environ | {
        "ENCORE_DATABASE_URL": f"sqlite:///{folder}/encore.db",
        "ENCORE_BOOTSTRAP_KEY": KEY,
        "ENCORE_LOG_LEVEL": "warning",
        "ENCORE_INDEX_TABLES": "off",
    }
    run = [sys.executable, "-m", "app.cli"]
    subprocess.run(
        [*run, "migrate"],
        check=True,
        env=environment,
        cwd=HERE,
        stdout=subprocess.DEVNULL,
    )
    return subprocess.Popen(
        [*run, "serve", "--port", str(port)], env=environment, cwd=HERE
    )


def handwritten(folder: Path, port: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "benchmarks.handwritten"]
    return subprocess.Popen([*command, f"{folder}/hand.db", str(port), KEY], cwd=HERE)


VARIANTS: dict[str, Callable[[Path, int], subprocess.Popen[bytes]]] = {
    "hand-written sqlite3": handwritten,
    "encore": encore,
}


@contextmanager
def served(variant: str) -> Iterator[tuple[int, int]]:
    """A server on the first core; its port and process."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        process = VARIANTS[variant](Path(folder), port)
        os.sched_setaffinity(process.pid, {0})
        try:
            wait(port)
            if variant == "encore":
                prepare(port)
            yield port, process.pid
        finally:
            process.terminate()
            process.wait()


def prepare(port: int) -> None:
    headers = {"Authorization": f"Bearer {KEY}"}
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", headers=headers) as client:
        load(client, paper_example(2))
        client.put("/v1/admin/policy", json={"name": "myopic"}).raise_for_status()


class Load:
    """Connections that ask for a play and answer it, again and again."""

    def __init__(self, port: int, seconds: float) -> None:
        self.port = port
        self.end = time.perf_counter() + seconds
        self.latencies: dict[str, list[float]] = {"next": [], "feedback": []}
        self.cpu = 0.0

    async def run(self, connections: int) -> None:
        await asyncio.gather(*(self.connection(n) for n in range(connections)))

    async def connection(self, number: int) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        turn = number
        while time.perf_counter() < self.end:
            user = f"user-{turn % USERS}"
            turn += 16
            body = await self.ask("next", reader, writer, get(user))
            play = body.partition(b'"play":"')[2][:36].decode()
            await self.ask("feedback", reader, writer, post(play, turn))
        writer.close()
        await writer.wait_closed()

    async def ask(
        self,
        kind: str,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        request: bytes,
    ) -> bytes:
        began = time.perf_counter()
        writer.write(request)
        head = await reader.readuntil(b"\r\n\r\n")
        if b" 200 " not in head[:16]:
            raise RuntimeError(head.decode())
        length = int(head.lower().partition(b"content-length: ")[2].split(b"\r\n")[0])
        body = await reader.readexactly(length)
        self.latencies[kind].append(time.perf_counter() - began)
        return body


def get(user: str) -> bytes:
    return (
        f"GET /v1/users/{user}/next HTTP/1.1\r\nHost: x\r\n"
        f"Authorization: Bearer {KEY}\r\n\r\n"
    ).encode()


def post(play: str, turn: int) -> bytes:
    body = '{"signal":"like"}' if turn % 3 else '{"signal":"skip"}'
    return (
        f"POST /v1/plays/{play}/feedback HTTP/1.1\r\nHost: x\r\n"
        f"Authorization: Bearer {KEY}\r\nContent-Type: application/json\r\n"
        f"Content-Length: {len(body)}\r\n\r\n{body}"
    ).encode()


def measure(variant: str, seconds: float, connections: int) -> Load:
    with served(variant) as (port, pid):
        asyncio.run(Load(port, 1.0).run(connections))  # warm
        before = cpu_seconds(pid)
        run = Load(port, seconds)
        asyncio.run(run.run(connections))
        run.cpu = cpu_seconds(pid) - before
    return run


def cpu_seconds(pid: int) -> float:
    """Processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def wait(port: int) -> None:
    end = time.monotonic() + 120
    for path in ("/health/ready", "/docs"):
        while time.monotonic() < end:
            try:
                if httpx.get(f"http://127.0.0.1:{port}{path}").status_code in {
                    200,
                    404,
                }:
                    break
            except httpx.TransportError:
                time.sleep(0.1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--connections", type=int, default=16)
    options = parser.parse_args()
    os.sched_setaffinity(0, {1})
    print(describe())
    rates: dict[str, list[float]] = {variant: [] for variant in VARIANTS}
    for _ in range(options.rounds):
        for variant, found in rates.items():
            run = measure(variant, options.seconds, options.connections)
            found.append(report(variant, run, options.seconds))
    yardstick, ours = rates.values()
    ratios = [b / a for a, b in zip(yardstick, ours, strict=True)]
    print(
        f"encore / hand-written: {statistics.median(ratios):.2f} (aim 0.60), "
        f"rounds {', '.join(f'{ratio:.2f}' for ratio in ratios)}"
    )


def report(variant: str, run: Load, seconds: float) -> float:
    rate = sum(len(found) for found in run.latencies.values()) / seconds
    cpu = run.cpu / sum(len(found) for found in run.latencies.values())
    parts = [f"{variant:22} {rate:7.0f} req/s {cpu * 1e6:5.0f} us CPU each"]
    for kind, found in run.latencies.items():
        quantiles = statistics.quantiles(found, n=100)
        parts.append(
            f"{kind} p50 {quantiles[49] * 1e3:5.2f} p99 {quantiles[98] * 1e3:6.2f} ms"
        )
    print("  ".join(parts), flush=True)
    return rate


if __name__ == "__main__":
    main()
