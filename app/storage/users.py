"""Where each user stands, read together with what is in force."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any
from uuid import UUID

import sqlalchemy as sa

from app.domain import Play, Revision, User
from app.storage import plays as log
from app.storage.play_rows import from_row
from app.storage.store import Store
from app.storage.tables import beliefs, plays, revision, users

STANDING = (
    revision.c.catalogue.label("revision_catalogue"),
    revision.c.epoch.label("revision_epoch"),
    revision.c.policy.label("revision_policy"),
    users.c.slot.label("user_slot"),
    users.c.version.label("user_version"),
    users.c.pending.label("user_pending"),
    beliefs.c.epoch.label("beliefs_epoch"),
    beliefs.c.packed,
)
BY_USER = (
    sa.select(*STANDING, plays)
    .select_from(revision)
    .outerjoin(users, users.c.id == sa.bindparam("user"))
    .outerjoin(beliefs, beliefs.c.user_id == users.c.id)
    .outerjoin(
        plays, sa.and_(plays.c.user_id == users.c.id, plays.c.id == users.c.pending)
    )
)
BY_PLAY = (
    sa.select(*STANDING, plays)
    .select_from(revision)
    .join(plays, plays.c.id == sa.bindparam("play"))
    .join(users, users.c.id == plays.c.user_id)
    .outerjoin(beliefs, beliefs.c.user_id == users.c.id)
)
MOVE = (
    users.update()
    .where(users.c.id == sa.bindparam("user"))
    .values(
        slot=sa.bindparam("to_slot"),
        pending=sa.bindparam("to_pending"),
        version=sa.bindparam("to_version"),
        last_seen=sa.bindparam("at"),
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
    row = store.row(BY_USER, {"user": user})
    if row is None:
        raise LookupError("the database has no revision row: it was not migrated")
    return _revision(row), _user(user, row)


def by_play(store: Store, play: UUID) -> tuple[Revision, User, Play] | None:
    """What is in force, where the play's user stands, and the play."""
    row = store.row(BY_PLAY, {"play": play})
    if row is None:
        return None
    asked = from_row(row)
    pending = asked if row.user_pending == asked.id else None
    standing = User(
        id=asked.user,
        slot=row.user_slot,
        version=row.user_version,
        pending=pending,
        epoch=row.beliefs_epoch or 0,
        packed=row.packed or b"",
    )
    return _revision(row), standing, asked


def move(
    store: Store, user: User, *, slot: int, pending: UUID | None, at: datetime
) -> None:
    """Note the user's next standing; written only if this one still stands."""
    store.rely_on_user(user.id, user.version)
    first = int(at.timestamp() * 1e6)  # so that a user erased never comes back as was
    store.write(
        MOVE,
        {
            "user": user.id,
            "to_slot": slot,
            "to_pending": pending,
            "to_version": user.version + 1 if user.version else first,
            "at": at,
        },
    )


def keep_beliefs(store: Store, user: str, epoch: int, packed: bytes) -> None:
    store.write(KEEP_BELIEFS, {"user": user, "epoch": epoch, "packed": packed})


def forget(store: Store, user: User) -> None:
    store.rely_on_user(user.id, user.version)
    log.forget(store, user.id)
    store.write(FORGET_BELIEFS, {"user": user.id})
    store.write(FORGET, {"user": user.id})


def page(store: Store, after: str, limit: int) -> Sequence[str]:
    """Users who have ever been served, in order of id."""
    return [row.id for row in store.rows(AFTER, {"after": after, "limit": limit})]


def _revision(row: sa.Row[Any]) -> Revision:
    return Revision(row.revision_catalogue, row.revision_epoch, row.revision_policy)


def _user(user: str, row: sa.Row[Any]) -> User:
    if row.user_version is None:
        return User(user)
    return User(
        id=user,
        slot=row.user_slot,
        version=row.user_version,
        pending=None if row.id is None else from_row(row),
        epoch=row.beliefs_epoch or 0,
        packed=row.packed or b"",
    )
