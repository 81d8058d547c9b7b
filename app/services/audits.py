"""Whether what is kept about users is what the log of plays says; and making it so."""

from collections.abc import AsyncIterator, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial

import numpy as np

from app.domain import Slate, User, settled
from app.errors import UserNotFound
from app.services import beliefs
from app.services.catalogue import Catalogue
from app.services.live import Live
from app.storage import plays, users
from app.storage.database import Database
from app.storage.packing import Entries, UnknownFormat, pack, unpack
from app.storage.plays import ClosedPlay
from app.storage.store import Store

TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class Finding:
    """Something kept about a user that the log contradicts."""

    user: str
    problem: str


@dataclass(frozen=True, slots=True)
class Audited:
    """One user's audit. `stale`: beliefs of earlier models, due to be rebuilt."""

    user: str
    plays: int
    stale: bool
    findings: Sequence[Finding]


async def audit(database: Database, live: Live) -> AsyncIterator[Audited]:
    """Recompute every user's beliefs from the log, and compare."""
    async for user in each_user(database):
        yield await database.run(partial(audit_user, live=live, user_id=user))


async def rebuild(
    database: Database, live: Live, user: str | None = None
) -> AsyncIterator[str]:
    """Replace kept beliefs by those that the log gives, while serving goes on."""
    if user is not None:
        await database.run(partial(rebuild_user, live=live, user_id=user))
        yield user
        return
    async for each in each_user(database):
        await database.run(partial(rebuild_user, live=live, user_id=each))
        yield each


async def each_user(database: Database) -> AsyncIterator[str]:
    """All users, in order of id."""
    after = ""
    while page := await database.run(partial(users.page, after=after, limit=1000)):
        for user in page:
            yield user
        after = page[-1]


def audit_user(store: Store, live: Live, user_id: str) -> Audited:
    """Compare one user's slot, pending play and beliefs with the log."""
    while True:
        revision, user = users.by_id(store, user_id)
        audited = _audited(store, live.catalogue(store, revision), user)
        _, after = users.by_id(store, user_id)
        if after.version == user.version:  # nothing was answered between the reads
            return audited


def rebuild_user(store: Store, live: Live, user_id: str) -> None:
    """Write the slot and the beliefs that one user's log gives."""
    revision, user = users.by_id(store, user_id)
    if user.version == 0:
        raise UserNotFound(user_id)
    catalogue = live.catalogue(store, revision)
    log = plays.closed(store, user_id)
    pending = plays.pending_of(store, user_id)
    kept_from, _ = users.kept(store, user_id)
    slot = _slot(log[-1].slot if log else kept_from - 1, pending)
    entries = beliefs.rebuilt(catalogue, log, settled(slot, pending))
    users.move(
        store,
        user,
        slot=slot,
        pending=pending,
        at=users.last_seen(store, user_id) or datetime.now(UTC),
        anchor=user.anchor,
    )
    users.keep_beliefs(store, user_id, catalogue.epoch, pack(entries))


def _audited(store: Store, catalogue: Catalogue, user: User) -> Audited:
    log = plays.closed(store, user.id)
    stale = user.slot > 0 and user.epoch != catalogue.epoch
    problems = [
        *_slots(store, user),
        *_pending(store, user),
        *([] if stale else _beliefs(catalogue, user, log)),
    ]
    findings = [Finding(user.id, problem) for problem in problems]
    return Audited(user.id, len(log), stale, findings)


def _slot(last: int, pending: Slate | None) -> int:
    """That after the last closed, or a later one in which what waits was chosen."""
    waiting = () if pending is None else pending.waiting
    return max([last + 1, *(play.slot for play in waiting)])


def _slots(store: Store, user: User) -> Iterator[str]:
    slots = plays.slots(store, user.id)
    by_plays_alone = user.anchor.clock == 0
    first, _ = users.kept(store, user.id)
    due = list(range(first, first + len(slots)))
    if by_plays_alone and [each.closed for each in slots] != due:
        yield f"the slots of its plays are not {first}, {first + 1} and so on"
    last = slots[-1].closed if slots else first - 1
    leads_to = _slot(last, plays.pending_of(store, user.id))
    if user.slot != leads_to:
        yield f"its slot is {user.slot}, but the log leads to {leads_to}"
    for slot in slots:
        if slot.slates != 1:
            yield f"its slot {slot.closed} is shared by plays not chosen together"


def _pending(store: Store, user: User) -> Iterator[str]:
    kept, kept_slot = users.pending_of(store, user.id)
    pending = plays.pending_of(store, user.id)
    logged = None if pending is None else pending.waiting[0].id
    logged_slot = None if pending is None else pending.taken
    if logged != kept:
        yield f"its pending play is {kept}, but the log says {logged}"
    if logged_slot != kept_slot:
        yield f"the slot of its pending plays is {kept_slot}, not {logged_slot}"


def _beliefs(
    catalogue: Catalogue, user: User, log: Sequence[ClosedPlay]
) -> Iterator[str]:
    expected = beliefs.rebuilt(catalogue, log, user.settled)
    try:
        kept = unpack(user.packed, catalogue.models.like.shape[1])
    except UnknownFormat as error:
        yield f"its beliefs cannot be read: {error}"
        return
    if catalogue.models.classes > 1 and kept.felt != expected.felt:
        yield "its mood is another than that of its answers"
    if not np.array_equal(kept.serial, expected.serial):
        yield "its beliefs are of other items than it has played"
        return
    yield from _differences(catalogue, kept, expected)


def _differences(
    catalogue: Catalogue, kept: Entries, expected: Entries
) -> Iterator[str]:
    apart = np.abs(kept.belief - expected.belief).max(axis=1, initial=0.0)
    wrong = ~(apart <= TOLERANCE) | (kept.slot != expected.slot)
    for row in np.flatnonzero(wrong).tolist():
        item = catalogue.shelf(int(kept.serial[row])).id
        if kept.slot[row] != expected.slot[row]:
            slots = f"{kept.slot[row]} and not {expected.slot[row]}"
            yield f"its belief of item {item!r} is of slot {slots}"
        if not apart[row] <= TOLERANCE:
            yield f"its belief of item {item!r} is off by {apart[row]:.3g}"
