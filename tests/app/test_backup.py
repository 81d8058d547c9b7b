"""The commands of docs/backup.md, run beside a service that takes answers."""

import re
import shlex
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from tests.app.commands import ROOT
from tests.app.postgres import Server
from tests.app.workers import served
from tests.catalogues import load, paper_example

PAGE = (ROOT / "docs" / "backup.md").read_text()
LISTENERS = 4
FEW = 40  # answers that are taken before the backup begins


def commands(heading: str) -> list[str]:
    """What a section of the page says to run."""
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    found = re.findall(r"^\$ (.*)$", section, re.MULTILINE)
    assert found
    return found


class Listeners:
    """They listen and answer without end; what was acknowledged is written down."""

    def __init__(self, client: httpx.Client) -> None:
        self.taken: list[str] = []
        self._client = client
        self._done = threading.Event()
        self._few = threading.Event()

    @contextmanager
    def listening(self) -> Iterator[None]:
        with ThreadPoolExecutor(LISTENERS) as threads:
            listeners = [threads.submit(self._listen, n) for n in range(LISTENERS)]
            try:
                assert self._few.wait(60)
                yield
            finally:
                self._done.set()
        for listener in listeners:
            listener.result()

    def _listen(self, number: int) -> None:
        while not self._done.is_set():
            path = f"/v1/users/user-{number}"
            play = self._client.get(f"{path}/next").raise_for_status().json()["play"]
            address = f"/v1/plays/{play}/feedback"
            self._client.post(address, json={"signal": "like"}).raise_for_status()
            self.taken.append(play)
            if len(self.taken) >= FEW:
                self._few.set()


def run(command: str, renamed: Mapping[str, str], folder: Path, server: Server) -> str:
    """Run a command of the page, with our names in the place of those it has."""
    for name, ours in renamed.items():
        command = command.replace(name, ours)
    program, *words = shlex.split(command)
    if program == "sqlite3":
        return run_sql(folder / words[0], words[1])
    if program == "encore":
        known = [sys.executable, "-m", "app.cli"]
    else:
        known = [str(server.bin / program)]
    at = ROOT if program == "encore" else folder
    return subprocess.run(
        [*known, *words], check=True, capture_output=True, text=True, cwd=at
    ).stdout


def run_sql(file: Path, sql: str) -> str:
    """As the command `sqlite3` does, in a process of its own."""
    code = (
        "import sqlite3, sys; print(*sqlite3.connect(sys.argv[1]).execute(sys.argv[2]))"
    )
    return subprocess.run(
        [sys.executable, "-c", code, file, sql],
        check=True,
        capture_output=True,
        text=True,
        cwd=file.parent,
    ).stdout


@pytest.mark.parametrize("kind", ["SQLite", "PostgreSQL"])
def test_what_was_acknowledged_before_is_in_a_backup_and_beliefs_are_whole(
    kind: str, request: pytest.FixtureRequest, tmp_path: Path, postgres: Server
) -> None:
    url: str = request.getfixturevalue(
        "sqlite_url" if kind == "SQLite" else "postgres_url"
    )
    if kind == "SQLite":
        restored = f"sqlite:///{tmp_path}/copy.db"
        renamed: dict[str, str] = {}
    else:
        name = f"{url.rpartition('/')[2]}_again"
        restored = postgres.url(name)
        renamed = {
            "postgresql://encore@db/encore": url,
            "postgresql://encore@db/restored": restored,
            "--host db": f"--host 127.0.0.1 --port {postgres.port}",
            "--username encore restored": f"--username postgres {name}",
        }

    with served(url) as client:
        load(client, paper_example(2))
        listeners = Listeners(client)
        with listeners.listening():
            before = list(listeners.taken)
            said = [run(one, renamed, tmp_path, postgres) for one in commands(kind)]
        after = listeners.taken[-1]
    renamed["postgresql://encore@db/restored"] = restored
    checks = commands("After a restore")
    said += [run(one, renamed, tmp_path, postgres) for one in checks]

    assert len(listeners.taken) > len(before) >= FEW
    assert kind != "SQLite" or "ok" in said[1]
    assert "0 faults" in said[-1]
    with served(restored) as client:
        for play in before:
            assert client.get(f"/v1/plays/{play}").json()["signal"] == "like"
        answer = {"signal": "like"}
        again = client.post(f"/v1/plays/{before[0]}/feedback", json=answer)
        assert again.json()["repeated"] is True
        lost = client.post(f"/v1/plays/{after}/feedback", json=answer)
        assert lost.status_code == 200 or lost.json()["code"] == "play_not_found"


def test_a_copy_of_sqlite_is_made_however_busy_it_is(tmp_path: Path) -> None:
    """A copy by pages would begin anew with each commit of another process."""
    file = tmp_path / "encore.db"
    with sqlite3.connect(file) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("CREATE TABLE t (n INTEGER)")
        connection.execute("INSERT INTO t VALUES (0)")
    connection.close()
    writing = subprocess.Popen(
        [sys.executable, "-c", WRITE_ON, file], stdout=subprocess.PIPE
    )
    try:
        assert writing.stdout is not None
        assert writing.stdout.readline() == b"writing\n"
        command, check = commands("SQLite")
        for _ in range(3):
            run_sql(file, shlex.split(command)[2])
            copy = tmp_path / "copy.db"
            assert "ok" in run_sql(copy, shlex.split(check)[2])
            copy.unlink()
        assert writing.poll() is None
    finally:
        writing.kill()
        writing.communicate()


WRITE_ON = """
import sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
print("writing", flush=True)
while True:
    connection.execute("UPDATE t SET n = n + 1")
"""
