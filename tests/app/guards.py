"""Listeners who tire of what they hear, and checks of the guard when a test wants."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any, TypeVar

import numpy as np

from app.services import guard
from app.services.guard import Checked
from app.services.guard_fallback import Fallback
from app.services.guard_rules import TERMS, Terms
from app.storage.database import Database
from app.storage.store import Store
from tests.app.service import Service

T = TypeVar("T")

ROUND_ROBIN = Fallback("round_robin", {})
QUICK = replace(TERMS, least=60, step=30, window=300, pause=timedelta(0))

TIRING: dict[str, Any] = {  # a play tires, rest restores
    "states": ["tired", "keen"],
    "play": [[0.95, 0.05], [0.9, 0.1]],
    "rest": [[0.5, 0.5], [0.05, 0.95]],
    "like": [0.1, 0.85],
    "prior": [0.1, 0.9],
}
WRONG = TIRING | {  # says the opposite
    "play": [[0.1, 0.9], [0.05, 0.95]],
    "rest": [[0.95, 0.05], [0.5, 0.5]],
}


@dataclass
class Listeners:
    """Their true states, by user and item; each has luck of its own."""

    service: Service
    users: int = 10
    items: int = 5
    truth: dict[str, Any] = field(default_factory=lambda: TIRING)
    seed: int = 0
    name: str = "user"

    def __post_init__(self) -> None:
        self.luck = [np.random.default_rng([self.seed, u]) for u in range(self.users)]
        keen = [luck.random(self.items) for luck in self.luck]
        self.keen = np.array(keen) < self.truth["prior"][1]
        self.next: list[dict[str, Any] | None] = [None] * self.users

    def open(self, model: dict[str, Any], policy: str = "myopic") -> None:
        """Fill a catalogue of which the model is told to be true."""
        self.service.put_model("pop", model)
        for item in range(self.items):
            self.service.put_item(f"item-{item}", "pop")
        self.service.set_policy(policy)

    def listen(self, plays: int) -> list[bool]:
        """So many plays of each; what was liked, in order."""
        return [
            self.listen_once(user) for _ in range(plays) for user in range(self.users)
        ]

    def listen_once(self, user: int) -> bool:
        play = self.next[user] or self.service.next(f"{self.name}-{user}")
        item = int(str(play["item"]).removeprefix("item-"))
        luck = self.luck[user].random(self.items + 1)
        liked = bool(luck[-1] < self.truth["like"][int(self.keen[user, item])])
        signal = "like" if liked else "skip"
        self.next[user] = self.service.answer(play["play"], signal, next=True)["next"]
        self._move(user, item, luck)
        return liked

    def forget_offers(self) -> None:
        """Ask anew, as after a restart."""
        self.next = [None] * self.users

    def _move(self, user: int, played: int, luck: "np.ndarray[Any, Any]") -> None:
        for item in range(self.items):
            matrix = self.truth["play" if item == played else "rest"]
            to_keen = matrix[int(self.keen[user, item])][1]
            self.keen[user, item] = luck[item] < to_keen


def run(service: Service, *works: Callable[[Store], T]) -> list[T]:
    """Run units of work at once, each as a process of its own would."""

    async def each(work: Callable[[Store], T]) -> T:
        database = Database(service.settings)
        try:
            return await database.run(work)
        finally:
            await database.close()

    async def all_() -> list[T]:
        return list(await asyncio.gather(*map(each, works)))

    return asyncio.run(all_())


def checks(
    service: Service,
    fallback: Fallback | None = ROUND_ROBIN,
    *,
    times: int = 1,
    terms: Terms = QUICK,
    later: timedelta = timedelta(0),
) -> list[Checked]:
    """Check, in several processes at once if told so."""
    now = datetime.now(UTC) + later
    check = partial(guard.check, now=now, fallback=fallback, terms=terms)
    return run(service, *[check] * times)


def report(service: Service) -> dict[str, Any]:
    answer = service.client.get("/v1/admin/guard")
    assert answer.is_success, answer.text
    told: dict[str, Any] = answer.json()
    return told


def judged(service: Service) -> dict[str, Any]:
    """How the only model stands."""
    [model] = report(service)["models"]
    stands: dict[str, Any] = model
    return stands


def until_fallen(listeners: Listeners, *, most: int = 30) -> None:
    """Listen and check until the guard has replaced the policy."""
    for _ in range(most):
        listeners.listen(3)
        [checked] = checks(listeners.service)
        if checked.replaced is not None:
            return
    raise AssertionError("the guard never fell back")
