"""What the plays of experiments add up to, and how far they were counted."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import NamedTuple
from uuid import UUID

import sqlalchemy as sa

from app.storage.prepared import Row
from app.storage.store import Store
from app.storage.tables import Instant, arm_totals, arm_users, plays, tally


@dataclass(frozen=True, slots=True)
class Tally:
    """How far plays were counted.

    after: the last play that was read
    until: plays chosen before are all counted
    """

    after: UUID
    until: datetime
    checked_at: datetime


@dataclass(frozen=True, slots=True)
class ArmUser:
    """What one user has done in the arm that the user met first.

    experiment: the version with which it began
    earned:     rewards of answered plays
    """

    user_id: str
    experiment: int
    arm: str
    plays: int = 0
    answered: int = 0
    earned: float = 0.0


@dataclass(frozen=True, slots=True)
class ArmTotal:
    """What all users of an arm have done.

    moved: plays that do not count, as the users were in another arm before
    sums:  over users, see `learning.sequential`
    """

    experiment: int
    arm: str
    users: int
    plays: int
    moved: int
    sums: Mapping[str, float]


class PlayRow(NamedTuple):
    """As much of a play as an experiment counts."""

    id: UUID
    user: str
    experiment: int | None
    arm: str | None
    model: str
    version: int
    created_at: datetime
    closed: int | None
    signal: str | None


TALLY = sa.select(tally.c.after, tally.c.until, tally.c.checked_at)
GO_ON = sa.text(
    "INSERT INTO tally (id, after, until, checked_at)"
    " VALUES (1, :after, :until, :checked_at)"
    " ON CONFLICT (id) DO UPDATE SET after = excluded.after,"
    " until = excluded.until, checked_at = excluded.checked_at"
).bindparams(
    sa.bindparam("after", type_=sa.Uuid),
    sa.bindparam("until", type_=Instant),
    sa.bindparam("checked_at", type_=Instant),
)
# By id, which rises with the moment of the choice: there is an index of it.
PLAYS = (
    sa.select(
        plays.c.id,
        plays.c.user_id,
        plays.c.experiment,
        plays.c.arm,
        plays.c.model,
        plays.c.model_version,
        plays.c.created_at,
        plays.c.closed,
        plays.c.signal,
    )
    .where(plays.c.id > sa.bindparam("after"), plays.c.id < sa.bindparam("before"))
    .order_by(plays.c.id)
    .limit(sa.bindparam("limit"))
)
USERS = sa.select(arm_users).where(
    arm_users.c.user_id.in_(sa.bindparam("users", expanding=True))
)
KEEP_USER = sa.text(
    "INSERT INTO arm_users (user_id, experiment, arm, plays, answered, earned)"
    " VALUES (:user_id, :experiment, :arm, :plays, :answered, :earned)"
    " ON CONFLICT (user_id) DO UPDATE SET experiment = excluded.experiment,"
    " arm = excluded.arm, plays = excluded.plays, answered = excluded.answered,"
    " earned = excluded.earned"
)
FORGET_USER = arm_users.delete().where(arm_users.c.user_id == sa.bindparam("user"))
TOTALS = sa.select(arm_totals).where(
    arm_totals.c.experiment == sa.bindparam("experiment")
)
TOTAL = TOTALS.where(arm_totals.c.arm == sa.bindparam("arm"))
KEEP_TOTAL = sa.text(
    "INSERT INTO arm_totals (experiment, arm, users, plays, moved, sums)"
    " VALUES (:experiment, :arm, :users, :plays, :moved, :sums)"
    " ON CONFLICT (experiment, arm) DO UPDATE SET users = excluded.users,"
    " plays = excluded.plays, moved = excluded.moved, sums = excluded.sums"
).bindparams(sa.bindparam("sums", type_=sa.JSON))


def last(store: Store) -> Tally | None:
    """How far plays were counted, None if never."""
    row = store.row(TALLY)
    return None if row is None else Tally(row.after, row.until, row.checked_at)


def go_on(store: Store, at: Tally) -> None:
    store.write(GO_ON, asdict(at))


def plays_between(
    store: Store, after: UUID, before: UUID, limit: int
) -> Sequence[PlayRow]:
    """Plays in the order in which they were chosen, or reported."""
    given = {"after": after, "before": before, "limit": limit}
    return [PlayRow._make(row) for row in store.rows(PLAYS, given)]


def users(store: Store, ids: Collection[str]) -> Sequence[ArmUser]:
    """What is kept of these users; of some, nothing."""
    found = store.rows(USERS, {"users": sorted(ids)})
    return [ArmUser(**row._asdict()) for row in found]


def keep_users(store: Store, kept: Collection[ArmUser]) -> None:
    if kept:
        store.write(KEEP_USER, *map(asdict, kept))


def forget_user(store: Store, user: str) -> None:
    store.write(FORGET_USER, {"user": user})


def totals(store: Store, experiment: int) -> Mapping[str, ArmTotal]:
    """What each arm of an experiment adds up to."""
    found = store.rows(TOTALS, {"experiment": experiment})
    return {row.arm: _total(row) for row in found}


def total(store: Store, experiment: int, arm: str) -> ArmTotal | None:
    """What an arm adds up to, None if nobody has met it."""
    row = store.row(TOTAL, {"experiment": experiment, "arm": arm})
    return None if row is None else _total(row)


def keep_total(store: Store, total: ArmTotal) -> None:
    store.write(KEEP_TOTAL, asdict(total))


def _total(row: Row) -> ArmTotal:
    return ArmTotal(**row._asdict())
