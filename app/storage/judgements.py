"""How the guard judges each model, and how far it has read the log of plays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from enum import StrEnum
from typing import NamedTuple
from uuid import UUID

import sqlalchemy as sa

from app.storage.prepared import Row
from app.storage.store import Store
from app.storage.tables import Instant, guard, judgements, plays


class State(StrEnum):
    """What the guard thinks of a model.

    TRIAL: a new version of a model that was not calm: not yet trusted
    """

    CALM = "calm"
    ALARM = "alarm"
    TRIAL = "trial"


@dataclass(frozen=True, slots=True)
class Judgement:
    """Of one version of a model, on plays of one policy.

    streak:  looks in a row that found it worse than simple rates; below zero: that
             found it fit to leave its state
    falls:   how often the policy was replaced for it
    answers: answered plays, those included that are not kept any more
    fresh:   of them, those since the last look
    scores:  what the last look found
    outcomes: the last answered plays, packed
    """

    model: str
    version: int
    policy: int
    state: State
    since: datetime
    streak: int = 0
    falls: int = 0
    answers: int = 0
    fresh: int = 0
    scores: Mapping[str, float | str] | None = None
    outcomes: bytes = b""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far the log was read, up to which play, and when that was."""

    after: UUID
    checked_at: datetime


class PlayRow(NamedTuple):
    """As much of a play as tells how good its prediction was."""

    id: UUID
    user: str
    item: int
    policy: int | None
    model: str
    version: int
    predicted: float
    created_at: datetime
    closed: int | None
    signal: str | None


NAMES = [field.name for field in fields(Judgement)]
PROGRESS = sa.select(guard.c.after, guard.c.checked_at)
GO_ON = sa.text(
    "INSERT INTO guard (id, after, checked_at) VALUES (1, :after, :checked_at)"
    " ON CONFLICT (id) DO UPDATE SET after = excluded.after,"
    " checked_at = excluded.checked_at"
).bindparams(
    sa.bindparam("after", type_=sa.Uuid), sa.bindparam("checked_at", type_=Instant)
)
EVERY = sa.select(judgements).order_by(judgements.c.model)
KEEP = sa.text(
    f"INSERT INTO judgements ({', '.join(NAMES)})"  # noqa: S608 - names of our own
    f" VALUES ({', '.join(f':{name}' for name in NAMES)})"
    " ON CONFLICT (model) DO UPDATE SET "
    + ", ".join(f"{name} = excluded.{name}" for name in NAMES[1:])
).bindparams(*(sa.bindparam(n, type_=judgements.c[n].type) for n in NAMES))
DROP = judgements.delete().where(judgements.c.model == sa.bindparam("of"))
# By id, which rises with the moment of the choice: there is an index of it.
PLAYS = (
    sa.select(
        plays.c.id,
        plays.c.user_id,
        plays.c.item,
        plays.c.policy,
        plays.c.model,
        plays.c.model_version,
        plays.c.predicted,
        plays.c.created_at,
        plays.c.closed,
        plays.c.signal,
    )
    .where(plays.c.id > sa.bindparam("after"))
    .order_by(plays.c.id)
    .limit(sa.bindparam("limit"))
)


def progress(store: Store) -> Progress | None:
    """How far the guard has read, None if it never did."""
    row = store.row(PROGRESS)
    return None if row is None else Progress(row.after, row.checked_at)


def go_on(store: Store, progress: Progress) -> None:
    values = {"after": progress.after, "checked_at": progress.checked_at}
    store.write(GO_ON, values)


def every(store: Store) -> Sequence[Judgement]:
    """The judgement of each model, in order of id."""
    return [_judgement(row) for row in store.rows(EVERY)]


def keep(store: Store, judgement: Judgement) -> None:
    """Note a judgement in place of an earlier one of the model."""
    store.write(KEEP, {name: getattr(judgement, name) for name in NAMES})


def drop(store: Store, model: str) -> None:
    store.write(DROP, {"of": model})


def plays_after(store: Store, after: UUID, limit: int) -> Sequence[PlayRow]:
    """Plays in the order in which they were chosen, or reported."""
    given = {"after": after, "limit": limit}
    return [PlayRow._make(row) for row in store.rows(PLAYS, given)]


def _judgement(row: Row) -> Judgement:
    values = row._asdict()
    return Judgement(**values | {"state": State(row.state)})
