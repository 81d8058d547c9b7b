"""The yardstick: next and feedback by hand, on `sqlite3`, with nothing else.

The same HTTP stack (uvicorn, FastAPI, Encore's middleware, Pydantic, a bearer key), the
same decision code, the same shape of statements, full durability and group commit; no
SQLAlchemy, no catalogue that changes, no filters, no swaps, no versions of models.
"""

import asyncio
import hashlib
import secrets
import sqlite3
import sys
import threading
import time
from queue import SimpleQueue
from typing import Annotated, Any

import numpy as np
import uvicorn
from fastapi import Depends, FastAPI, HTTPException
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from pydantic import BaseModel
from starlette.middleware import Middleware
from uuid_utils.compat import uuid7

from app import logs
from app.api.middleware import BodyLimit, Observed, PathsAsSent
from policies import (
    LIKE,
    SKIP,
    ModelSet,
    Situation,
    answered,
    choose,
    create,
    expected_like,
    ready,
    rested,
    untouched,
    warm_up,
)
from simulation import example

SCHEMA = """
PRAGMA journal_mode=WAL;
CREATE TABLE IF NOT EXISTS users (
    id TEXT PRIMARY KEY, slot INT, pending TEXT, version INT, seen REAL);
CREATE TABLE IF NOT EXISTS beliefs (user TEXT PRIMARY KEY, packed BLOB);
CREATE TABLE IF NOT EXISTS plays (
    user TEXT, id TEXT, item INT, slot INT, seed INT, predicted REAL, propensity REAL,
    created REAL, signal TEXT, answered REAL, PRIMARY KEY (user, id));
CREATE INDEX IF NOT EXISTS plays_id ON plays (id);
CREATE UNIQUE INDEX IF NOT EXISTS plays_slot ON plays (user, slot);
"""
BY_USER = """SELECT u.slot, u.pending, u.version, b.packed, p.item, p.predicted,
    p.propensity FROM (SELECT 1) LEFT JOIN users u ON u.id = ?
    LEFT JOIN beliefs b ON b.user = u.id
    LEFT JOIN plays p ON p.user = u.id AND p.id = u.pending"""
BY_PLAY = """SELECT p.user, p.item, p.signal, u.slot, u.version, b.packed FROM plays p
    JOIN users u ON u.id = p.user LEFT JOIN beliefs b ON b.user = u.id WHERE p.id = ?"""
MOVE = """INSERT INTO users VALUES (?, ?, ?, ?, ?) ON CONFLICT (id) DO UPDATE SET
    slot = excluded.slot, pending = excluded.pending, version = excluded.version,
    seen = excluded.seen WHERE users.version = excluded.version - 1"""
ENTER = "INSERT INTO plays VALUES (?, ?, ?, ?, ?, ?, ?, ?, NULL, NULL)"
CLOSE = "UPDATE plays SET signal = ?, answered = ? WHERE user = ? AND id = ?"
KEEP = """INSERT INTO beliefs VALUES (?, ?)
    ON CONFLICT (user) DO UPDATE SET packed = excluded.packed"""

ENTRY = np.dtype([("item", "<i8"), ("slot", "<i8"), ("belief", "<f8", 4)])
Statement = tuple[str, tuple[object, ...]]
bearer = HTTPBearer()


class Answer(BaseModel):
    signal: str


class Next(BaseModel):
    play: str
    user: str
    item: str
    slot: int
    like: float
    propensity: float


class Taken(BaseModel):
    play: str
    signal: str
    slot: int


class Writer:
    """One thread, whatever waits in one transaction."""

    def __init__(self, path: str) -> None:
        self.queue: SimpleQueue[tuple[list[Statement], asyncio.Future[bool]]] = (
            SimpleQueue()
        )
        self.path = path
        threading.Thread(target=self.run, daemon=True).start()

    async def commit(self, statements: list[Statement]) -> bool:
        done: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self.queue.put((statements, done))
        return await done

    def run(self) -> None:
        database = sqlite3.connect(self.path, isolation_level=None)
        database.execute("PRAGMA synchronous=FULL")
        while True:
            batch = [self.queue.get()]
            while not self.queue.empty() and len(batch) < 256:
                batch.append(self.queue.get())
            database.execute("BEGIN IMMEDIATE")
            results = [self.apply(database, statements) for statements, _ in batch]
            database.execute("COMMIT")
            for (_, done), stands in zip(batch, results, strict=True):
                done.get_loop().call_soon_threadsafe(done.set_result, stands)

    @staticmethod
    def apply(database: sqlite3.Connection, statements: list[Statement]) -> bool:
        for number, (sql, values) in enumerate(statements):
            if database.execute(sql, values).rowcount == 0 and number == 0:
                return False
        return True


def build(path: str, key: str) -> FastAPI:
    sqlite3.connect(path).executescript(SCHEMA)
    paper = example(2)
    names, models = paper.ids, ModelSet.of(paper.models)
    scorer = ready(create("myopic", {}), models)
    reader = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    writer = Writer(path)
    wanted = hashlib.sha256(key.encode()).digest()
    app = FastAPI(
        middleware=[
            Middleware(PathsAsSent),
            Middleware(Observed),
            Middleware(BodyLimit, limit=1_000_000, import_limit=1_000_000),
        ]
    )
    logs.configure("warning")
    warm_up()

    async def check(
        credentials: Annotated[HTTPAuthorizationCredentials, Depends(bearer)],
    ) -> None:
        sent = hashlib.sha256(credentials.credentials.encode()).digest()
        if not secrets.compare_digest(sent, wanted):
            raise HTTPException(401)

    def unpack(packed: bytes | None) -> np.ndarray[Any, Any]:
        return np.frombuffer(bytearray(packed or b""), ENTRY)

    @app.get("/v1/users/{user}/next", dependencies=[Depends(check)])
    async def next_play(user: str) -> Next:
        row = reader.execute(BY_USER, (user,)).fetchone()
        slot, pending, version, packed, item, like, propensity = row
        if pending is not None:
            return Next(
                play=pending,
                user=user,
                item=names[item],
                slot=slot,
                like=like,
                propensity=propensity,
            )
        slot = slot or 0
        entries = unpack(packed)
        played = entries["item"].copy()
        belief = untouched(models, slot)
        belief[played] = rested(
            models, played, entries["belief"].copy(), slot - entries["slot"]
        )
        rows = np.arange(len(names))
        situation = Situation(models, rows, belief, np.ones_like(rows), rows)
        seed = secrets.randbits(63)
        choice = choose(scorer(situation, seed), situation.count, seed)
        chosen = slice(choice.group, choice.group + 1)
        like = float(expected_like(models, rows[chosen], belief[chosen])[0])
        play, now = str(uuid7()), time.time()
        entered = (user, play, choice.group, slot, seed, like, choice.propensity, now)
        await writer.commit(
            [(MOVE, (user, slot, play, (version or 0) + 1, now)), (ENTER, entered)]
        )
        return Next(
            play=play,
            user=user,
            item=names[choice.group],
            slot=slot,
            like=like,
            propensity=choice.propensity,
        )

    @app.post("/v1/plays/{play}/feedback", dependencies=[Depends(check)])
    async def feedback(play: str, answer: Answer) -> Taken:
        row = reader.execute(BY_PLAY, (play,)).fetchone()
        user, item, _, slot, version, packed = row
        entries = unpack(packed)
        known = entries["item"] == item
        at = np.array([item])
        before = (
            rested(
                models,
                at,
                entries["belief"][known].copy(),
                slot - entries["slot"][known],
            )
            if known.any()
            else untouched(models, slot)[item : item + 1]
        )
        signal = LIKE if answer.signal == "like" else SKIP
        after = answered(models, item, before[0], signal).belief
        entry = np.array([(item, slot + 1, after)], ENTRY)
        kept = np.concatenate((entries[~known], entry)).tobytes()
        now = time.time()
        await writer.commit(
            [
                (MOVE, (user, slot + 1, None, version + 1, now)),
                (CLOSE, (answer.signal, now, user, play)),
                (KEEP, (user, kept)),
            ]
        )
        return Taken(play=play, signal=answer.signal, slot=slot + 1)

    return app


if __name__ == "__main__":
    database, port, bearer_key = sys.argv[1:]
    uvicorn.run(
        build(database, bearer_key),
        port=int(port),
        access_log=False,
        log_config=None,
    )
