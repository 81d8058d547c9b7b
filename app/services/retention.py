"""Old plays, dropped: what is left is the log, as if there never was more.

A user's plays are dropped from the first on, up to a slot, and beliefs become those
that the rest of the log gives rise to. Of an item that was not played since for as long
as anything is remembered, they stay the same.
"""

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from functools import partial

from app.domain import User
from app.services import beliefs
from app.services.audits import each_user
from app.services.live import Live
from app.storage import audit, plays, users
from app.storage.database import Database
from app.storage.packing import pack
from app.storage.store import Store


async def prune(
    database: Database, live: Live, before: datetime, by: str, *, dry_run: bool = False
) -> AsyncIterator[int]:
    """Drop plays that were offered before a moment; tell how many, user by user."""
    work = dropped_of if dry_run else partial(drop_of, live=live)
    dropped = 0
    async for user in each_user(database):
        found = await database.run(partial(work, user_id=user, before=before))
        dropped += found
        yield found
    if dropped and not dry_run:
        detail = {"before": before.isoformat(), "plays": dropped}
        note = partial(audit.note, at=datetime.now(UTC), by=by, action="prune")
        await database.run(partial(note, subject="", detail=detail))


def dropped_of(store: Store, user_id: str, before: datetime) -> int:
    """How many plays of a user would be dropped."""
    _, user = users.by_id(store, user_id)
    return plays.count_before(store, user_id, _kept_from(store, user, before))


def drop_of(store: Store, live: Live, user_id: str, before: datetime) -> int:
    """Drop a user's plays; tell how many."""
    revision, user = users.by_id(store, user_id)
    kept_from = _kept_from(store, user, before)
    count = plays.count_before(store, user_id, kept_from)
    if count == 0:
        return 0
    catalogue = live.catalogue(store, revision)
    log = [play for play in plays.closed(store, user_id) if play.slot >= kept_from]
    entries = beliefs.rebuilt(catalogue, log, user.settled)
    users.move(
        store,
        user,
        slot=user.slot,
        pending=user.pending,
        at=users.last_seen(store, user_id) or datetime.now(UTC),
        anchor=user.anchor,
    )
    users.keep_beliefs(store, user_id, catalogue.epoch, pack(entries))
    plays.drop(store, user_id, kept_from)
    waits = user.pending is not None
    users.keep_from(store, user_id, kept_from, replayed_from=user.slot + waits)
    return count


def _kept_from(store: Store, user: User, before: datetime) -> int:
    """The first slot that is kept, or that is still to come."""
    if user.version == 0:
        return 0
    first = plays.first_since(store, user.id, before)
    slots = [user.slot if first is None else first]
    if user.pending is not None:
        slots.append(user.pending.slot(user.slot))
    return min(slots)
