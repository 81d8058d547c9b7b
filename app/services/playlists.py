"""A plan for the next plays, before any of them is answered."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from app.domain import NO_ANSWER, Described, PolicyVersion, Selection
from app.services import moods, selections
from app.services.allotment import allotted
from app.services.catalogue import Shelf
from app.services.ladder import Decided
from app.services.live import Live
from app.services.moods import Mood
from app.services.policy_catalogue import checked
from app.services.standing import Standing
from app.storage import users
from app.storage.plays import ClosedPlay
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is to be planned.

    repeats: whether an item may be planned twice; if not, the plan may end early
    tried:   the policy to plan by, None: that which serves the user
    """

    selection: Selection
    length: int
    repeats: bool
    tried: Described | None = None


@dataclass(frozen=True, slots=True)
class Planned:
    """A play that is planned.

    pending: it is being shown already
    rung:    of the policy, that chose it; None: it is pending
    """

    shelf: Shelf
    slot: int
    like: float
    pending: bool
    rung: int | None = None


@dataclass(frozen=True, slots=True)
class Plan:
    """Plays in order.

    mood:    that of the first, which lasts as none is answered
    policy:  that planned them
    decided: how
    """

    mood: Mood | None
    plays: Sequence[Planned]
    policy: PolicyVersion
    decided: Sequence[Decided]


def plan(store: Store, live: Live, user_id: str, wanted: Wanted) -> Plan:
    """What the policy would play if no answer came; nothing is changed by asking."""
    revision, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, revision)
    pool = selections.pool(catalogue, wanted.selection)
    policy = (
        allotted(store, live, revision, catalogue, user_id).policy
        if wanted.tried is None
        else live.tried(store, catalogue, checked(wanted.tried, at="policy."))
    )
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    mood = moods.described(catalogue.models, standing.felt())
    planned: list[Planned] = []
    decided: list[Decided] = []
    waiting = () if user.pending is None else user.pending.waiting[: wanted.length]
    for play in waiting:
        slot = standing.take_place(play)
        shown = ClosedPlay(play.item, slot, NO_ANSWER, play.place, play.created_at)
        planned.append(_planned(standing, shown))
    standing.keep_time(revision.clock)
    if not wanted.repeats:
        pool = pool.without(np.array([play.item for play in waiting], np.int64))
    while len(planned) < wanted.length and not pool.is_empty:
        slot = standing.slot
        decided.append(standing.decide(policy, pool, _seed(user_id, slot)))
        [decision] = decided[-1].made
        imagined = ClosedPlay(decision.serial, slot, NO_ANSWER, 0, standing.at)
        planned.append(_planned(standing, imagined, rung=decided[-1].rung))
        if not wanted.repeats:
            pool = pool.without(np.array([decision.serial]))
    return Plan(mood, planned, policy.version, decided)


def _planned(standing: Standing, play: ClosedPlay, rung: int | None = None) -> Planned:
    shelf = standing.catalogue.shelf(play.item)
    like = standing.expected(play.item, play.slot, play.created_at)
    standing.take(play)
    return Planned(shelf, play.slot, like, rung is None, rung)


def _seed(user_id: str, slot: int) -> int:
    """The same plan for the same question."""
    named = hashlib.blake2b(f"{slot}:{user_id}".encode(), digest_size=8).digest()
    return int.from_bytes(named) >> 1
