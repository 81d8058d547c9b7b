"""A database full of users, in the time that it takes to copy rows.

Some users live through histories of their own, by `encore import`; the others are
copies of them, made where they lie. So what is measured has grown as it does in use.
"""

import asyncio
import json
import os
import random
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import asyncpg

from app.storage import tables
from tests.catalogues import paper_example

HERE = Path(__file__).parent.parent
ORIGINALS = 64
COPY = (
    "INSERT INTO {table} ({columns}) WITH RECURSIVE number(n) AS"
    " (SELECT 0 UNION ALL SELECT n + 1 FROM number WHERE n + 1 < {users})"
    " SELECT {copied} FROM number"
    " JOIN {table} t ON t.{key} = 'original-' || (n % {originals})"
)
FORGET = "DELETE FROM {table} WHERE {key} LIKE 'original-%'"
PRUNE = (
    "DELETE FROM plays WHERE closed < {first}",
    "UPDATE users SET kept_from = {first}, replayed_from = slot",
)
SEEN = "UPDATE guard SET after = (SELECT id FROM plays ORDER BY id DESC LIMIT 1)"
IDS = {
    "sqlite": "printf('%016x%016x', n, t.slot)",
    "postgresql": "(lpad(to_hex(n), 16, '0') || lpad(to_hex(t.slot), 16, '0'))::uuid",
}


class Used(NamedTuple):
    """What a command took; its memory at the most."""

    seconds: float
    megabytes: float


@dataclass(frozen=True, slots=True)
class Table:
    """A table that holds rows of users."""

    name: str
    key: str
    columns: Sequence[str]
    ids: Sequence[str] = ()

    def copies(self, dialect: str, users: int) -> Iterator[str]:
        """The statements that leave copies of the originals in place of them."""
        made = {self.key: "'user-' || n"} | dict.fromkeys(self.ids, IDS[dialect])
        yield COPY.format(
            table=self.name,
            columns=", ".join(self.columns),
            users=users,
            copied=", ".join(made.get(name, f"t.{name}") for name in self.columns),
            key=self.key,
            originals=ORIGINALS,
        )
        yield FORGET.format(table=self.name, key=self.key)


TABLES = (
    Table("users", "id", tables.users.columns.keys()),
    Table("beliefs", "user_id", tables.beliefs.columns.keys()),
    Table("plays", "user_id", tables.plays.columns.keys(), ids=("id", "slate")),
)


@dataclass(frozen=True, slots=True)
class Population:
    """Users who have played so many of the items, one after the other.

    logged: how many of these plays the log still holds, the others were pruned;
        None: all
    """

    users: int = 10_000
    played: int = 50
    items: int = 100
    logged: int | None = None

    def fill(self, database_url: str, folder: Path) -> Mapping[str, Used]:
        """Migrate a database and fill it; its users are user-0 and so on.

        Tells what each import took.
        """
        used = self.found(database_url, folder)
        if self.logged is not None:
            first = self.played - self.logged
            run(database_url, [statement.format(first=first) for statement in PRUNE])
        self.multiply(database_url, TABLES, SEEN)  # the guard has seen their plays
        return used

    def found(self, database_url: str, folder: Path) -> Mapping[str, Used]:
        """Migrate a database; enter the catalogue, and users original-0 and so on."""
        contents = {
            "models": paper_example(2),
            "items": self._items(),
            "history": self._history(),
        }
        encore(database_url, "migrate")
        used = {}
        for kind, lines in contents.items():
            file = folder / f"{kind}.ndjson"
            with file.open("w") as opened:
                opened.writelines(json.dumps(line) + "\n" for line in lines)
            used[kind] = encore(database_url, "import", kind, str(file))
        return used

    def multiply(
        self, database_url: str, tables: Sequence[Table], *afterwards: str
    ) -> None:
        """Replace the originals of a database by copies."""
        dialect = database_url.partition(":")[0]
        statements = [
            statement
            for table in tables
            for statement in table.copies(dialect, self.users)
        ]
        run(database_url, [*statements, *afterwards])

    def _items(self) -> Iterator[Mapping[str, str]]:
        models = [model["id"] for model in paper_example(2)]
        for number in range(self.items):
            model = models[number % len(models)]
            yield {"id": f"item-{number}", "model": model, "title": f"Item {number}"}

    def _history(self) -> Iterator[Mapping[str, str]]:
        draw = random.Random(1)  # noqa: S311 - no secret
        for user in range(ORIGINALS):
            for item in draw.sample(range(self.items), self.played):
                signal = draw.choice(("like", "skip"))
                name = f"original-{user}"
                yield {"user": name, "item": f"item-{item}", "signal": signal}


def run(database_url: str, statements: Sequence[str]) -> None:
    """Run statements in one transaction, then let the database tidy up."""
    if database_url.startswith("sqlite"):
        with sqlite3.connect(database_url.removeprefix("sqlite:///")) as connection:
            for statement in statements:
                connection.execute(statement)
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        connection.close()
    else:
        asyncio.run(_run_postgresql(database_url, statements))


async def _run_postgresql(database_url: str, statements: Sequence[str]) -> None:
    connection = await asyncpg.connect(database_url)
    async with connection.transaction():
        for statement in statements:
            await connection.execute(statement)
    await connection.execute("VACUUM ANALYZE")
    await connection.execute("CHECKPOINT")
    await connection.close()


def encore(database_url: str, *words: str) -> Used:
    """Run a command."""
    began = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "app.cli", *words],
        env=os.environ | {"ENCORE_DATABASE_URL": database_url},
        cwd=HERE,
        stdout=subprocess.DEVNULL,
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, words)
    return Used(time.perf_counter() - began, usage.ru_maxrss * 1024 / 1e6)
