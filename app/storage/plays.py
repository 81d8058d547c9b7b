"""The log of plays: the truth from which every belief can be rebuilt."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any
from uuid import UUID

import sqlalchemy as sa

from app.domain import Answer, Play
from app.storage.play_rows import from_row, to_row
from app.storage.store import Store
from app.storage.tables import items, plays

INSERT = plays.insert()
CLOSE = (
    plays.update()
    .where(plays.c.user_id == sa.bindparam("user"), plays.c.id == sa.bindparam("play"))
    .values(
        signal=sa.bindparam("answer_signal"),
        fraction=sa.bindparam("answer_fraction"),
        closed=sa.bindparam("in_slot"),
        answered_at=sa.bindparam("at"),
    )
)
FORGET = plays.delete().where(plays.c.user_id == sa.bindparam("user"))
BY_KEY = sa.select(plays).where(
    plays.c.user_id == sa.bindparam("user"),
    plays.c.idempotency_key == sa.bindparam("key"),
)
BY_ID = sa.select(plays).where(plays.c.id == sa.bindparam("play"))
CLOSED_PLAYS = (
    sa.select(plays.c.item, plays.c.closed, plays.c.signal)
    .where(plays.c.user_id == sa.bindparam("user"), plays.c.closed.is_not(None))
    .order_by(plays.c.closed)
)
BEFORE_SLOT = CLOSED_PLAYS.where(plays.c.closed < sa.bindparam("slot"))
PAGE = (
    sa.select(plays, items.c.id.label("item_id"))
    .join(items, items.c.serial == plays.c.item)
    .where(
        plays.c.user_id == sa.bindparam("user"),
        plays.c.closed.is_not(None),
        plays.c.closed < sa.bindparam("before"),
    )
    .order_by(plays.c.closed.desc())
    .limit(sa.bindparam("limit"))
)

HISTORY = (
    sa.select(
        items.c.id.label("item"),
        plays.c.closed,
        plays.c.signal,
        plays.c.fraction,
        plays.c.answered_at,
    )
    .join(items, items.c.serial == plays.c.item)
    .where(
        plays.c.user_id == sa.bindparam("user"),
        plays.c.closed > sa.bindparam("after"),
    )
    .order_by(plays.c.closed)
    .limit(sa.bindparam("limit"))
)
KEYS = sa.select(plays.c.idempotency_key).where(
    plays.c.user_id == sa.bindparam("user"), plays.c.idempotency_key.is_not(None)
)
PENDING_OF = sa.select(plays.c.id).where(
    plays.c.user_id == sa.bindparam("user"), plays.c.closed.is_(None)
)
PENDING = sa.select(sa.func.count()).where(plays.c.closed.is_(None))


@dataclass(frozen=True, slots=True)
class ClosedPlay:
    """As much of a closed play as moves a belief."""

    item: int
    slot: int
    signal: str


def insert(store: Store, play: Play) -> None:
    store.write(INSERT, to_row(play))


def close(store: Store, play: Play, slot: int, answer: Answer, at: datetime) -> None:
    """Note the answer of a pending play, and the slot in which it took place."""
    store.write(
        CLOSE,
        {
            "user": play.user,
            "play": play.id,
            "answer_signal": answer.signal,
            "answer_fraction": answer.fraction,
            "in_slot": slot,
            "at": at,
        },
    )


def forget(store: Store, user: str) -> None:
    store.write(FORGET, {"user": user})


def by_id(store: Store, play: UUID) -> Play | None:
    row = store.row(BY_ID, {"play": play})
    return None if row is None else from_row(row)


def by_idempotency_key(store: Store, user: str, key: str) -> Play | None:
    row = store.row(BY_KEY, {"user": user, "key": key})
    return None if row is None else from_row(row)


def closed(store: Store, user: str, before: int | None = None) -> list[ClosedPlay]:
    """A user's closed plays in the order in which they took place."""
    if before is None:
        rows = store.rows(CLOSED_PLAYS, {"user": user})
    else:
        rows = store.rows(BEFORE_SLOT, {"user": user, "slot": before})
    return [ClosedPlay(row.item, row.closed, row.signal) for row in rows]


def page(store: Store, user: str, before: int, limit: int) -> Sequence[Play]:
    """Closed plays before a slot, the latest first."""
    rows = store.rows(PAGE, {"user": user, "before": before, "limit": limit})
    return [from_row(row) for row in rows]


def every(store: Store, user: str, *, before: int, size: int = 500) -> Iterator[Play]:
    """All plays of a user that were closed before a slot, the latest first."""
    while plays_ := page(store, user, before, size):
        yield from plays_
        before = plays_[-1].closed or 0
        store.pause()


def history(store: Store, user: str, after: int, limit: int) -> Sequence[sa.Row[Any]]:
    """Item id, slot, signal, fraction and moment of closed plays after a slot."""
    return store.rows(HISTORY, {"user": user, "after": after, "limit": limit})


def idempotency_keys(store: Store, user: str) -> set[str]:
    """The keys under which plays of a user were reported."""
    return {row.idempotency_key for row in store.rows(KEYS, {"user": user})}


def pending_of(store: Store, user: str) -> UUID | None:
    """The play of a user that has no answer."""
    row = store.row(PENDING_OF, {"user": user})
    return None if row is None else UUID(str(row.id))


def count_pending(store: Store) -> int:
    row = store.row(PENDING)
    return 0 if row is None else int(row[0])
