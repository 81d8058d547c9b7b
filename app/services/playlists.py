"""A plan for the next plays, before any of them is answered."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from app.domain import NO_ANSWER, Selection
from app.services import moods, selections
from app.services.catalogue import Shelf
from app.services.live import Live
from app.services.moods import Mood
from app.services.standing import Standing
from app.storage import users
from app.storage.plays import ClosedPlay
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class Planned:
    """A play that is planned. `pending`: it is being shown already."""

    shelf: Shelf
    slot: int
    like: float
    pending: bool


@dataclass(frozen=True, slots=True)
class Plan:
    """Plays in order. `mood`: that of the first, which lasts as none is answered."""

    mood: Mood | None
    plays: Sequence[Planned]


def plan(
    store: Store,
    live: Live,
    user_id: str,
    selection: Selection,
    length: int,
    *,
    repeats: bool,
) -> Plan:
    """What the policy would play if no answer came; nothing is changed by asking.

    Without repeats no item is planned twice: the plan may end early.
    """
    revision, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, revision)
    pool = selections.pool(catalogue, selection)
    policy = live.policy(store, revision, catalogue)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    mood = moods.described(catalogue.models, standing.felt())
    planned: list[Planned] = []
    waiting = () if user.pending is None else user.pending.waiting[:length]
    for play in waiting:
        slot = standing.take_place(play)
        shown = ClosedPlay(play.item, slot, NO_ANSWER, play.place, play.created_at)
        planned.append(_planned(standing, shown, pending=True))
    standing.keep_time(revision.clock)
    if not repeats:
        pool = pool.without(np.array([play.item for play in waiting], np.int64))
    while len(planned) < length and not pool.is_empty:
        slot = standing.slot
        [decision] = standing.decide(policy, pool, _seed(user_id, slot))
        imagined = ClosedPlay(decision.serial, slot, NO_ANSWER, 0, standing.at)
        planned.append(_planned(standing, imagined, pending=False))
        if not repeats:
            pool = pool.without(np.array([decision.serial]))
    return Plan(mood, planned)


def _planned(standing: Standing, play: ClosedPlay, *, pending: bool) -> Planned:
    shelf = standing.catalogue.shelf(play.item)
    like = standing.expected(play.item, play.slot, play.created_at)
    standing.take(play)
    return Planned(shelf, play.slot, like, pending)


def _seed(user_id: str, slot: int) -> int:
    """The same plan for the same question."""
    named = hashlib.blake2b(f"{slot}:{user_id}".encode(), digest_size=8).digest()
    return int.from_bytes(named) >> 1
