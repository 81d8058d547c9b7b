"""A trial of policies: simulated listeners live with each in turn, over HTTP."""

import asyncio
import math
import statistics
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass
from uuid import uuid4

import numpy as np

from app.demo.client import Client
from app.demo.listeners import Listener, Nature
from app.domain import Described
from app.services.policy import history, swap
from app.storage.store import Store

NOTE = "trial"
LATEST = 2**31 - 1
POLICIES = (
    "random",
    "round_robin",
    "myopic",
    "best_fixed",
    "rollout",
    "whittle",
    "exact_rollout",
)
NORMAL_95 = 1.96


@dataclass(frozen=True, slots=True)
class Trial:
    """How many listeners live for how many plays; their natures follow the seed."""

    listeners: int
    plays: int
    seed: int = 0
    policies: Sequence[str] = POLICIES


@dataclass(frozen=True, slots=True)
class Lived:
    """What listeners made of one policy.

    slots:       by which their users moved on
    likes:       rewards of their plays, added up: 1 for a like
    like_rate:   likes by play
    ci95:        half of its 95 % interval, from the spread between listeners
    decision_ms: mean time that the service took to choose an item
    """

    policy: str
    listeners: int
    plays: int
    slots: int
    likes: float
    like_rate: float
    ci95: float | None
    decision_ms: float | None


@dataclass(slots=True)
class _Life:
    """What one user heard and liked."""

    client: Client
    listener: Listener
    user: str
    plays: int = 0
    likes: float = 0.0
    slot: int = 0

    async def live(self, plays: int, played: Callable[[], object]) -> None:
        """Hear, answer, hear the next; the last answer asks for nothing more."""
        play = await self.client.next_play(self.user)
        while True:
            heard = self.listener.hear(play.item)
            self.plays += 1
            self.likes += heard.reward
            more = self.plays < plays
            taken = await self.client.answer(play, heard.signal, then=more)
            played()
            if taken.next is None:
                self.slot = taken.slot
                return
            play = taken.next


async def run(
    client: Client, trial: Trial, played: Callable[[str], object]
) -> AsyncIterator[Lived]:
    """Let listeners live with each policy; put back the one that was in force."""
    nature = Nature.of(await client.models(), await client.items())
    before = await client.policy()
    name = f"{NOTE}-{uuid4().hex[:8]}"
    async with AsyncExitStack() as stack:
        connections = [
            await stack.enter_async_context(client.another())
            for _ in range(trial.listeners)
        ]
        for policy in trial.policies:
            lives = [
                _Life(
                    connection,
                    Listener(nature, np.random.default_rng([trial.seed, number])),
                    f"{name}-{policy}-{number}",
                )
                for number, connection in enumerate(connections)
            ]
            await client.swap(policy, {}, NOTE)
            yield await _lived(client, policy, lives, trial.plays, played)
    await client.swap(before.name, before.params, f"after the {NOTE}")


def clean_up(store: Store, by: str) -> None:
    """Put back the policy that was in force before a trial that was cut short."""
    past = history(store, LATEST, limit=100).versions
    earlier = [policy for policy in past if policy.note != NOTE]
    if earlier and past[0].note == NOTE:
        last = earlier[0]
        put_back = Described(last.name, last.params)
        swap(store, put_back, f"after a {NOTE} cut short", by)


async def _lived(
    client: Client,
    policy: str,
    lives: Sequence[_Life],
    plays: int,
    played: Callable[[str], object],
) -> Lived:
    count, seconds = await client.decisions(policy)
    await asyncio.gather(*(life.live(plays, lambda: played(policy)) for life in lives))
    count_after, seconds_after = await client.decisions(policy)
    decided = count_after - count
    took = (seconds_after - seconds) / decided * 1000 if decided else None
    return _summary(policy, lives, took)


def _summary(policy: str, lives: Sequence[_Life], took: float | None) -> Lived:
    plays = sum(life.plays for life in lives)
    likes = sum(life.likes for life in lives)
    rates = [life.likes / life.plays for life in lives]
    spread = statistics.stdev(rates) if len(rates) > 1 else None
    return Lived(
        policy=policy,
        listeners=len(lives),
        plays=plays,
        slots=sum(life.slot for life in lives),
        likes=likes,
        like_rate=likes / plays,
        ci95=None if spread is None else NORMAL_95 * spread / math.sqrt(len(rates)),
        decision_ms=took,
    )
