"""The servers that are compared, filled with the same users, all on the first core."""

import asyncio
import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import asyncpg
import httpx
import numpy as np

from app.storage.packing import unpack
from benchmarks.population import HERE, Population, Table
from benchmarks.throughput import postgresql, sqlite, statements
from tests.app.postgres import Server, free_port

KEY = "a-key-for-the-benchmark"
SERVER_CORE, LOAD_CORE = 0, 1
STATES = 4
DURABLE = ("shared_buffers=512MB", "max_wal_size=4GB")  # all else as it comes
HAND = [sys.executable, "-m", "benchmarks.throughput.handwritten"]
ENCORE = [sys.executable, "-m", "app.cli", "serve", "--port"]
FRAMEWORK = [sys.executable, "-m", "benchmarks.throughput.framework"]
TABLES = (
    Table("users", "id", ("id", "slot", "pending", "version", "seen")),
    Table("beliefs", "user_id", ("user_id", "packed")),
    Table("plays", "user_id", ("user_id", "id", "item", "slot", "signal"), ("id",)),
)
Rows = Mapping[str, Sequence[tuple[object, ...]]]


@dataclass(frozen=True, slots=True)
class Running:
    """A server that answers."""

    name: str
    port: int
    pid: int
    started: float = 0.0  # seconds until it answered

    def megabytes(self, name: str = "VmHWM") -> float:
        """Memory that it has had at the most; `VmRSS`: that it has now."""
        told = Path(f"/proc/{self.pid}/status").read_text().split()
        return int(told[told.index(f"{name}:") + 1]) * 1024 / 1e6

    def cpu(self) -> float:
        """Seconds of processor time of all its threads, also of those that ended."""
        told = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, told[11:13])) / os.sysconf("SC_CLK_TCK")

    def pause(self) -> None:
        """Let it do nothing at all, also in the background."""
        os.kill(self.pid, signal.SIGSTOP)

    def go_on(self) -> None:
        os.kill(self.pid, signal.SIGCONT)


@contextmanager
def contestants(kind: str, population: Population) -> Iterator[Sequence[Running]]:
    """The yardstick, Encore by the web framework, and Encore as it is.

    Each on a database of its own, all of one kind.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        hand, *ours = databases(kind, folder, stack, "hand", "framework", "encore")
        _fill_by_hand(hand, population, folder)
        for url in ours:
            population.fill(url, folder)
        address = hand.removeprefix("sqlite:///")
        commands = {
            "hand-written": [*HAND, address, str(population.items), KEY],
            "framework": FRAMEWORK,
            "encore": ENCORE,
        }
        servers = [
            stack.enter_context(served(f"{name} {kind}", command, url))
            for (name, command), url in zip(
                commands.items(), (hand, *ours), strict=True
            )
        ]
        for server in servers[1:]:
            swap(server.port)
        yield servers


def databases(kind: str, folder: Path, stack: ExitStack, *names: str) -> Sequence[str]:
    """Where there is nothing yet."""
    if kind == "sqlite":
        return [f"sqlite:///{folder}/{name}.db" for name in names]
    server = Server(DURABLE)
    stack.callback(server.stop)
    for name in names:
        server.execute(f"CREATE DATABASE {name}")
    return [server.url(name) for name in names]


def _fill_by_hand(url: str, population: Population, folder: Path) -> None:
    """Fill the yardstick's database with the same users."""
    rows = _originals(population, folder)
    types = sqlite.TYPES if url.startswith("sqlite") else postgresql.TYPES
    made = [table.format(**types) for table in statements.TABLES]
    if url.startswith("sqlite"):
        with sqlite3.connect(url.removeprefix("sqlite:///")) as connection:
            connection.execute("PRAGMA journal_mode=WAL")
            for statement in made:
                connection.execute(statement)
            for table in TABLES:
                marks = ", ".join("?" * len(table.columns))
                insert = f"INSERT INTO {table.name} ({', '.join(table.columns)})"
                connection.executemany(f"{insert} VALUES ({marks})", rows[table.name])
        connection.close()
    else:
        asyncio.run(_fill_postgresql(url, made, rows))
    population.multiply(url, TABLES)


async def _fill_postgresql(url: str, made: Sequence[str], rows: Rows) -> None:
    connection = await asyncpg.connect(url)
    for statement in made:
        await connection.execute(statement)
    for table in TABLES:
        await connection.copy_records_to_table(
            table.name, records=rows[table.name], columns=table.columns
        )
    await connection.close()


def _originals(population: Population, folder: Path) -> Rows:
    """Encore's originals, as rows of the yardstick."""
    file = folder / "originals.db"
    population.found(f"sqlite:///{file}", folder)
    with sqlite3.connect(file) as connection:
        users = connection.execute("SELECT id, slot, 1 FROM users").fetchall()
        plays = connection.execute(
            "SELECT user_id, id, item, closed, signal FROM plays"
        ).fetchall()
        packed = connection.execute("SELECT user_id, packed FROM beliefs").fetchall()
    connection.close()
    return {
        "users": [(user, slot, None, version, None) for user, slot, version in users],
        "beliefs": [(user, _repacked(held)) for user, held in packed],
        "plays": plays,
    }


def _repacked(packed: bytes) -> bytes:
    entries = unpack(packed, STATES)
    columns = entries.serial, entries.slot, entries.belief
    rows = np.empty(len(entries.serial), statements.ENTRY)
    for name, column in zip(("item", "slot", "belief"), columns, strict=True):
        rows[name] = column
    return rows.tobytes()


@contextmanager
def served(
    name: str, command: Sequence[str], database_url: str, index_tables: str = "off"
) -> Iterator[Running]:
    """A server in a process of its own, once it answers; its last word is a port."""
    port = free_port()
    environment = os.environ | {
        "ENCORE_DATABASE_URL": database_url,
        "ENCORE_BOOTSTRAP_KEY": KEY,
        "ENCORE_LOG_LEVEL": "warning",
        "ENCORE_INDEX_TABLES": index_tables,
    }
    began = time.perf_counter()
    process = subprocess.Popen([*command, str(port)], env=environment, cwd=HERE)
    os.sched_setaffinity(process.pid, {SERVER_CORE})
    try:
        _wait(port, process)
        yield Running(name, port, process.pid, time.perf_counter() - began)
    finally:
        process.send_signal(signal.SIGCONT)
        process.terminate()
        process.wait()


def _wait(port: int, process: "subprocess.Popen[bytes]") -> None:
    while process.poll() is None:
        with suppress(httpx.TransportError):
            if httpx.get(f"http://127.0.0.1:{port}/health/ready").is_success:
                return
        time.sleep(0.1)
    raise RuntimeError(f"{process.args!r} ended with {process.returncode}")


def swap(port: int) -> None:
    """Put the yardstick's policy in force."""
    httpx.put(
        f"http://127.0.0.1:{port}/v1/admin/policy",
        json={"name": "myopic"},
        headers={"Authorization": f"Bearer {KEY}"},
    ).raise_for_status()
