"""A plan for the next plays, before any of them is answered."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain import NO_ANSWER, Answer, Selection
from app.services import beliefs, selections
from app.services.catalogue import Shelf
from app.services.live import Live
from app.services.standing import Standing
from app.storage import users
from app.storage.store import Store

UNANSWERED = Answer(NO_ANSWER)


@dataclass(frozen=True, slots=True)
class Planned:
    """A play that is planned. `pending`: it is being shown already."""

    shelf: Shelf
    slot: int
    like: float
    pending: bool


def plan(
    store: Store, live: Live, user_id: str, selection: Selection, length: int
) -> Sequence[Planned]:
    """What the policy would play if no answer came; nothing is changed by asking."""
    revision, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, revision)
    pool = selections.pool(catalogue, selection)
    policy = live.policy(store, revision, catalogue)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    planned: list[Planned] = []
    if user.pending is not None:
        planned.append(_planned(standing, user.pending.item, pending=True))
    while len(planned) < length:
        seed = _seed(user_id, standing.slot)
        decision = standing.decide(policy, pool, seed)
        planned.append(_planned(standing, decision.serial, pending=False))
    return planned


def _planned(standing: Standing, serial: int, *, pending: bool) -> Planned:
    catalogue, slot = standing.catalogue, standing.slot
    belief, _ = beliefs.of_item(catalogue, standing.entries, slot, serial)
    like = beliefs.expected(catalogue, serial, belief)
    standing.learn(serial, UNANSWERED)
    return Planned(catalogue.shelf(serial), slot, like, pending)


def _seed(user_id: str, slot: int) -> int:
    """The same plan for the same question."""
    named = hashlib.blake2b(f"{slot}:{user_id}".encode(), digest_size=8).digest()
    return int.from_bytes(named) >> 1
