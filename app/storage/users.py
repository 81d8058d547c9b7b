"""Where each user stands, read together with what is in force."""

from collections.abc import Sequence
from datetime import datetime
from operator import attrgetter
from uuid import UUID

import sqlalchemy as sa

from app.domain import Anchor, Clock, Play, Revision, Slate, User
from app.storage import plays as log
from app.storage import tallies
from app.storage.play_rows import from_row
from app.storage.prepared import Row
from app.storage.store import Store
from app.storage.tables import beliefs, plays, revision, users

STANDING = (
    revision.c.catalogue.label("revision_catalogue"),
    revision.c.epoch.label("revision_epoch"),
    revision.c.policy.label("revision_policy"),
    revision.c.clock.label("revision_clock"),
    revision.c.slot_s.label("revision_slot_s"),
    revision.c.experiment.label("revision_experiment"),
    users.c.slot.label("user_slot"),
    users.c.version.label("user_version"),
    users.c.pending.label("user_pending"),
    users.c.pending_slot.label("user_pending_slot"),
    users.c.clock.label("user_clock"),
    users.c.began.label("user_began"),
    beliefs.c.epoch.label("beliefs_epoch"),
    # Once is enough, with the first of the plays that wait.
    sa.case((plays.c.id != users.c.pending, None), else_=beliefs.c.packed).label(
        "packed"
    ),
)
WAITING = sa.and_(plays.c.user_id == users.c.id, plays.c.closed.is_(None))
BY_USER = (
    sa.select(*STANDING, plays)
    .select_from(revision)
    .outerjoin(users, users.c.id == sa.bindparam("user"))
    .outerjoin(beliefs, beliefs.c.user_id == users.c.id)
    .outerjoin(plays, WAITING)
)
ASKED = plays.alias("asked")
BY_PLAY = (
    sa.select(*STANDING, plays)
    .select_from(revision)
    .join(ASKED, ASKED.c.id == sa.bindparam("play"))
    .join(users, users.c.id == ASKED.c.user_id)
    .outerjoin(beliefs, beliefs.c.user_id == users.c.id)
    .outerjoin(plays, WAITING)
)
PENDING = sa.select(users.c.pending, users.c.pending_slot).where(
    users.c.id == sa.bindparam("user")
)
LAST_SEEN = sa.select(users.c.last_seen).where(users.c.id == sa.bindparam("user"))
MOVE = (
    users.update()
    .where(users.c.id == sa.bindparam("user"))
    .values(
        slot=sa.bindparam("to_slot"),
        pending=sa.bindparam("to_pending"),
        pending_slot=sa.bindparam("to_pending_slot"),
        version=sa.bindparam("to_version"),
        last_seen=sa.bindparam("at"),
        clock=sa.bindparam("to_clock"),
        began=sa.bindparam("to_began"),
    )
)
KEPT = sa.select(users.c.kept_from, users.c.replayed_from).where(
    users.c.id == sa.bindparam("user")
)
KEEP_FROM = (
    users.update()
    .where(users.c.id == sa.bindparam("user"))
    .values(
        kept_from=sa.bindparam("to_kept_from"),
        replayed_from=sa.bindparam("to_replayed_from"),
    )
)
FORGET = users.delete().where(users.c.id == sa.bindparam("user"))
FORGET_BELIEFS = beliefs.delete().where(beliefs.c.user_id == sa.bindparam("user"))
KEEP_BELIEFS = sa.text(
    "INSERT INTO beliefs (user_id, epoch, packed) VALUES (:user, :epoch, :packed)"
    " ON CONFLICT (user_id) DO UPDATE SET epoch = excluded.epoch,"
    " packed = excluded.packed"
).bindparams(sa.bindparam("packed", type_=sa.LargeBinary))
AFTER = (
    sa.select(users.c.id)
    .where(users.c.id > sa.bindparam("after"))
    .order_by(users.c.id)
    .limit(sa.bindparam("limit"))
)


def by_id(store: Store, user: str) -> tuple[Revision, User]:
    """What is in force, and where the user stands."""
    rows = store.rows(BY_USER, {"user": user})
    if not rows:
        raise LookupError("the database has no revision row: it was not migrated")
    return _revision(rows[0]), _user(user, rows, _waiting(rows))


def by_play(store: Store, play: UUID) -> tuple[Revision, User, Play] | None:
    """What is in force, where the play's user stands, and the play."""
    rows = store.rows(BY_PLAY, {"play": play})
    if not rows:
        return None
    waiting = _waiting(rows)
    asked = next((one for one in waiting if one.id == play), None)
    asked = asked or log.by_id(store, play)
    if asked is None:
        return None
    return _revision(rows[0]), _user(asked.user, rows, waiting), asked


def pending_of(store: Store, user: str) -> tuple[UUID | None, int | None]:
    """The first play said to be pending, and the slot said to be taken."""
    row = store.row(PENDING, {"user": user})
    return (None, None) if row is None else (row.pending, row.pending_slot)


def last_seen(store: Store, user: str) -> datetime | None:
    """When a user was last served or told of."""
    row = store.row(LAST_SEEN, {"user": user})
    return None if row is None else row.last_seen


def move(
    store: Store,
    user: User,
    *,
    slot: int,
    pending: Slate | None,
    at: datetime,
    anchor: Anchor,
) -> None:
    """Note the user's next standing; written only if this one still stands."""
    store.rely_on_user(user.id, user.version)
    first = int(at.timestamp() * 1e6)  # so that a user erased never comes back as was
    store.write(
        MOVE,
        {
            "user": user.id,
            "to_slot": slot,
            "to_pending": None if pending is None else pending.waiting[0].id,
            "to_pending_slot": None if pending is None else pending.taken,
            "to_version": user.version + 1 if user.version else first,
            "at": at,
            "to_clock": anchor.clock,
            "to_began": anchor.began,
        },
    )


def keep_beliefs(store: Store, user: str, epoch: int, packed: bytes) -> None:
    store.write(KEEP_BELIEFS, {"user": user, "epoch": epoch, "packed": packed})


def kept(store: Store, user: str) -> tuple[int, int]:
    """The first slot whose plays were not dropped, and whose choices can be retaken."""
    row = store.row(KEPT, {"user": user})
    return (0, 0) if row is None else (row.kept_from, row.replayed_from)


def keep_from(store: Store, user: str, slot: int, *, replayed_from: int) -> None:
    """Note that plays before a slot are dropped; `move` the user besides."""
    given = {"to_kept_from": slot, "to_replayed_from": replayed_from}
    store.write(KEEP_FROM, {"user": user, **given})


def forget(store: Store, user: User) -> None:
    store.rely_on_user(user.id, user.version)
    log.forget(store, user.id)
    store.write(FORGET_BELIEFS, {"user": user.id})
    tallies.forget_user(store, user.id)
    store.write(FORGET, {"user": user.id})


def page(store: Store, after: str, limit: int) -> Sequence[str]:
    """Users who have ever been served, in order of id."""
    return [row.id for row in store.rows(AFTER, {"after": after, "limit": limit})]


def _revision(row: Row) -> Revision:
    return Revision(
        row.revision_catalogue,
        row.revision_epoch,
        row.revision_policy,
        Clock(row.revision_clock, row.revision_slot_s),
        row.revision_experiment,
    )


def _waiting(rows: Sequence[Row]) -> tuple[Play, ...]:
    found = [from_row(row) for row in rows if row.id is not None]
    return tuple(sorted(found, key=attrgetter("place")))


def _user(user: str, rows: Sequence[Row], waiting: tuple[Play, ...]) -> User:
    row = rows[0]
    if row.user_version is None:
        return User(user)
    is_pending = waiting and row.user_pending is not None
    return User(
        id=user,
        slot=row.user_slot,
        version=row.user_version,
        pending=Slate(waiting, row.user_pending_slot) if is_pending else None,
        epoch=row.beliefs_epoch or 0,
        packed=next((row.packed for row in rows if row.packed), b""),
        anchor=Anchor(row.user_clock, row.user_began),
    )
