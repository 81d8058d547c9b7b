"""The log of plays: the truth from which every belief can be rebuilt."""

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import NamedTuple, TypeAlias
from uuid import UUID

import sqlalchemy as sa

from app.domain import Answer, Play, Slate
from app.storage.play_rows import from_row, to_row
from app.storage.prepared import Row
from app.storage.store import Store
from app.storage.tables import items, plays, users

Position: TypeAlias = tuple[int, int]  # a slot, and a place in it

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
DROP = plays.delete().where(
    plays.c.user_id == sa.bindparam("user"), plays.c.closed < sa.bindparam("slot")
)
COUNT_BEFORE = (
    sa.select(sa.func.count())
    .select_from(plays)
    .where(
        plays.c.user_id == sa.bindparam("user"), plays.c.closed < sa.bindparam("slot")
    )
)
FIRST_SINCE = sa.select(sa.func.min(plays.c.closed)).where(
    plays.c.user_id == sa.bindparam("user"), plays.c.created_at >= sa.bindparam("at")
)
BY_KEY = sa.select(plays).where(
    plays.c.user_id == sa.bindparam("user"),
    plays.c.idempotency_key == sa.bindparam("key"),
)
BY_ID = sa.select(plays).where(plays.c.id == sa.bindparam("play"))
CLOSED_PLAYS = (
    sa.select(
        plays.c.item,
        plays.c.closed.label("slot"),
        plays.c.signal,
        plays.c.place,
        plays.c.created_at,
    )
    .where(plays.c.user_id == sa.bindparam("user"), plays.c.closed.is_not(None))
    .order_by(plays.c.closed, plays.c.place)
)
BEFORE_SLOT = CLOSED_PLAYS.where(plays.c.closed < sa.bindparam("slot"))
WHERE = sa.tuple_(plays.c.closed, plays.c.place)
GIVEN = sa.tuple_(
    sa.bindparam("slot", type_=sa.Integer), sa.bindparam("place", type_=sa.Integer)
)
PAGE = (
    sa.select(plays, items.c.id.label("item_id"))
    .join(items, items.c.serial == plays.c.item)
    .where(plays.c.user_id == sa.bindparam("user"), WHERE < GIVEN)
    .order_by(plays.c.closed.desc(), plays.c.place.desc())
    .limit(sa.bindparam("limit"))
)

HISTORY = (
    sa.select(
        items.c.id.label("item"),
        plays.c.closed,
        plays.c.place,
        plays.c.signal,
        plays.c.fraction,
        plays.c.answered_at,
        users.c.clock,
    )
    .join(items, items.c.serial == plays.c.item)
    .join(users, users.c.id == plays.c.user_id)
    .where(plays.c.user_id == sa.bindparam("user"), WHERE > GIVEN)
    .order_by(plays.c.closed, plays.c.place)
    .limit(sa.bindparam("limit"))
)
LOG = (
    sa.select(
        plays.c.user_id,
        items.c.id.label("item"),
        plays.c.closed,
        plays.c.place,
        plays.c.signal,
        plays.c.created_at,
        plays.c.propensity,
    )
    .join(items, items.c.serial == plays.c.item)
    .where(
        plays.c.closed.is_not(None),
        sa.tuple_(plays.c.user_id, plays.c.closed, plays.c.place)
        > sa.tuple_(
            sa.bindparam("user", type_=sa.String),
            sa.bindparam("slot", type_=sa.Integer),
            sa.bindparam("place", type_=sa.Integer),
        ),
    )
    .order_by(plays.c.user_id, plays.c.closed, plays.c.place)
    .limit(sa.bindparam("limit"))
)
KEYS = sa.select(plays.c.idempotency_key).where(
    plays.c.user_id == sa.bindparam("user"), plays.c.idempotency_key.is_not(None)
)
WAITING = (
    sa.select(plays)
    .where(plays.c.user_id == sa.bindparam("user"), plays.c.closed.is_(None))
    .order_by(plays.c.place)
)
OF_SLATE = (
    sa.select(plays.c.item, plays.c.closed)
    .where(
        plays.c.user_id == sa.bindparam("user"), plays.c.slate == sa.bindparam("slate")
    )
    .order_by(plays.c.place)
)
SLOTS = (
    sa.select(
        plays.c.closed,
        sa.func.count().label("plays"),
        sa.func.count(plays.c.slate.distinct()).label("slates"),
    )
    .where(plays.c.user_id == sa.bindparam("user"), plays.c.closed.is_not(None))
    .group_by(plays.c.closed)
    .order_by(plays.c.closed)
)
PENDING = sa.select(sa.func.count()).where(plays.c.closed.is_(None))


class ClosedPlay(NamedTuple):
    """As much of a closed play as moves a belief, or a mood."""

    item: int
    slot: int
    signal: str
    place: int
    created_at: datetime


class LogRow(NamedTuple):
    """As much of a closed play as models are learned from. `item`: its id."""

    user: str
    item: str
    closed: int
    place: int
    signal: str
    created_at: datetime
    propensity: float | None


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


def drop(store: Store, user: str, slot: int) -> None:
    """Drop the plays that a user closed before a slot."""
    store.write(DROP, {"user": user, "slot": slot})


def count_before(store: Store, user: str, slot: int) -> int:
    """How many plays a user closed before a slot."""
    row = store.row(COUNT_BEFORE, {"user": user, "slot": slot})
    return 0 if row is None else int(row[0])


def first_since(store: Store, user: str, at: datetime) -> int | None:
    """The first slot with a play that was offered at a moment or later."""
    row = store.row(FIRST_SINCE, {"user": user, "at": at})
    return None if row is None else row[0]


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
    return [ClosedPlay._make(row) for row in rows]


def page(store: Store, user: str, before: Position, limit: int) -> Sequence[Play]:
    """Closed plays before a position, the latest first."""
    slot, place = before
    given = {"user": user, "slot": slot, "place": place, "limit": limit}
    return [from_row(row) for row in store.rows(PAGE, given)]


def every(store: Store, user: str, *, before: int, size: int = 500) -> Iterator[Play]:
    """All plays of a user that were closed before a slot, the latest first."""
    position = (before, 0)
    while plays_ := page(store, user, position, size):
        yield from plays_
        position = (plays_[-1].closed or 0, plays_[-1].place)
        store.pause()


def history(store: Store, user: str, after: Position, limit: int) -> Sequence[Row]:
    """Closed plays after another, as they are exported; clock 0: the user has none."""
    slot, place = after
    given = {"user": user, "slot": slot, "place": place, "limit": limit}
    return store.rows(HISTORY, given)


def log(store: Store, after: tuple[str, int, int], limit: int) -> Sequence[LogRow]:
    """Closed plays of all users after a user's position, user by user, in order."""
    user, slot, place = after
    given = {"user": user, "slot": slot, "place": place, "limit": limit}
    return [LogRow._make(row) for row in store.rows(LOG, given)]


def idempotency_keys(store: Store, user: str) -> set[str]:
    """The keys under which plays of a user were reported."""
    return {row.idempotency_key for row in store.rows(KEYS, {"user": user})}


def pending_of(store: Store, user: str) -> Slate | None:
    """The plays of a user that have no answer, and the slot that is theirs."""
    waiting = tuple(from_row(row) for row in store.rows(WAITING, {"user": user}))
    if not waiting:
        return None
    together = of_slate(store, waiting[0])
    taken = [closed for _, closed in together if closed is not None]
    return Slate(waiting, min(taken, default=None))


def of_slate(store: Store, play: Play) -> Sequence[tuple[int, int | None]]:
    """Item and closed slot of all plays of a play's slate, by place."""
    rows = store.rows(OF_SLATE, {"user": play.user, "slate": play.slate})
    return [(row.item, row.closed) for row in rows]


def slots(store: Store, user: str) -> Sequence[Row]:
    """Each slot of a user, how many plays it holds, and of how many slates."""
    return store.rows(SLOTS, {"user": user})


def count_pending(store: Store) -> int:
    row = store.row(PENDING)
    return 0 if row is None else int(row[0])
