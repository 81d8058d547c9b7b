"""The yardstick: next and feedback by hand, and nothing else.

The same HTTP stack (uvicorn, FastAPI, Encore's middleware, Pydantic, a bearer key), the
same decision code and the same shape of statements; no SQLAlchemy, no catalogue that
changes, no filters, no swaps, no versions of models, no replay, no clock, no moods.
"""

import hashlib
import secrets
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

import numpy as np
import uvicorn
from fastapi import Depends, FastAPI, HTTPException
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from numpy.typing import NDArray
from pydantic import BaseModel
from starlette.middleware import Middleware
from uuid_utils.compat import uuid7

from app import logs
from app.api.middleware import BodyLimit, Observed, PathsAsSent
from benchmarks.throughput.postgresql import PostgreSQL
from benchmarks.throughput.sqlite import SQLite
from benchmarks.throughput.statements import ENTRY, Offered, Standing, Taken
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

SIGNALS = ["skip", "like"]
bearer = HTTPBearer()


class Answer(BaseModel):
    signal: str


class Next(BaseModel):
    play: str
    user: str
    item: str
    slot: int
    like: float
    signals: list[str]
    propensity: float
    pending: bool


class Acknowledged(BaseModel):
    play: str
    signal: str
    slot: int
    repeated: bool = False


class Decider:
    """The decision code, with a catalogue that stays as it is."""

    def __init__(self, items: int) -> None:
        self.models = ModelSet.of(example(2).models)
        self.model = np.arange(items) % len(self.models.states)
        self.names = [f"item-{number}" for number in range(items)]
        self._ones = np.ones(items, np.int64)
        self._rested = np.zeros(items, np.int64)
        self._scorer = ready(create("myopic", {}), self.models)

    def decide(self, user: str, standing: Standing) -> Offered:
        entries, slot = unpacked(standing.packed), standing.slot
        played = entries["item"].copy()
        belief = untouched(self.models, slot)[self.model]
        belief[played] = rested(
            self.models,
            self.model[played],
            entries["belief"].copy(),
            slot - entries["slot"],
        )
        situation = Situation(self.models, self.model, belief, self._ones, self._rested)
        seed = secrets.randbits(63)
        choice = choose(self._scorer(situation, seed), situation.count, seed)
        item = slice(choice.group, choice.group + 1)
        like = expected_like(self.models, self.model[item], belief[item])
        return Offered(
            user,
            str(uuid7()),
            choice.group,
            slot,
            seed,
            float(like[0]),
            choice.propensity,
        )

    def learn(self, packed: bytes, item: int, slot: int, signal: str) -> bytes:
        entries, model = unpacked(packed), int(self.model[item])
        known = entries["item"] == item
        before = untouched(self.models, slot)[model]
        if known.any():
            waited = slot - entries["slot"][known]
            belief = entries["belief"][known].copy()
            before = rested(self.models, np.array([model]), belief, waited)[0]
        told = LIKE if signal == "like" else SKIP
        after = answered(self.models, model, before, told).belief
        entry = np.array([(item, slot + 1, after)], ENTRY)
        return np.concatenate((entries[~known], entry)).tobytes()


def build(database: SQLite | PostgreSQL, items: int, key: str) -> FastAPI:
    decider = Decider(items)
    wanted = hashlib.sha256(key.encode()).digest()

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        await database.open()
        yield

    app = FastAPI(
        lifespan=lifespan,
        middleware=[
            Middleware(PathsAsSent),
            Middleware(Observed),
            Middleware(BodyLimit, limit=1_000_000, import_limit=1_000_000),
        ],
    )
    logs.configure("warning")
    warm_up()

    async def check(
        credentials: Annotated[HTTPAuthorizationCredentials, Depends(bearer)],
    ) -> None:
        sent = hashlib.sha256(credentials.credentials.encode()).digest()
        if not secrets.compare_digest(sent, wanted):
            raise HTTPException(401)

    @app.get("/health/ready")
    async def is_ready() -> None:
        pass

    @app.get("/v1/users/{user}/next", dependencies=[Depends(check)])
    async def next_play(user: str) -> Next:
        async with database.unit() as unit:
            standing = await unit.by_user(user)
            if standing.pending is not None:
                play = Offered(
                    user,
                    standing.pending,
                    standing.item,
                    standing.slot,
                    0,
                    standing.predicted,
                    standing.propensity,
                )
            else:
                play = decider.decide(user, standing)
                if not await unit.offer(play, standing.version):
                    raise HTTPException(409)
        return Next(
            play=play.play,
            user=user,
            item=decider.names[play.item],
            slot=play.slot,
            like=play.predicted,
            signals=SIGNALS,
            propensity=play.propensity,
            pending=standing.pending is not None,
        )

    @app.post("/v1/plays/{play}/feedback", dependencies=[Depends(check)])
    async def feedback(play: str, answer: Answer) -> Acknowledged:
        async with database.unit() as unit:
            asked = await unit.by_play(play)
            kept = decider.learn(asked.packed, asked.item, asked.slot, answer.signal)
            taken = Taken(asked.user, play, answer.signal, kept)
            if not await unit.take(taken, asked.slot + 1, asked.version):
                raise HTTPException(409)
        return Acknowledged(play=play, signal=answer.signal, slot=asked.slot + 1)

    return app


def unpacked(packed: bytes) -> NDArray[Any]:
    return np.frombuffer(bytearray(packed), ENTRY)


if __name__ == "__main__":
    address, item_count, bearer_key, port = sys.argv[1:]
    opened = PostgreSQL(address) if "://" in address else SQLite(address)
    uvicorn.run(
        build(opened, int(item_count), bearer_key),
        port=int(port),
        access_log=False,
        log_config=None,
    )
