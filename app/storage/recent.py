"""The latest plays of all users, read backwards."""

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple
from uuid import UUID

import sqlalchemy as sa

from app.storage.store import Store
from app.storage.tables import plays


class PlayRow(NamedTuple):
    """As much of a play as tells how things go."""

    id: UUID
    user: str
    policy: int | None
    model: str
    version: int
    predicted: float
    created_at: datetime
    signal: str | None


# By id, which rises with the moment of the choice: there is an index of it.
PLAYS = (
    sa.select(
        plays.c.id,
        plays.c.user_id,
        plays.c.policy,
        plays.c.model,
        plays.c.model_version,
        plays.c.predicted,
        plays.c.created_at,
        plays.c.signal,
    )
    .where(plays.c.id > sa.bindparam("after"), plays.c.id < sa.bindparam("before"))
    .order_by(plays.c.id.desc())
    .limit(sa.bindparam("limit"))
)


def plays_before(
    store: Store, before: UUID, after: UUID, limit: int
) -> Sequence[PlayRow]:
    """Plays between the two, the latest first."""
    given = {"after": after, "before": before, "limit": limit}
    return [PlayRow._make(row) for row in store.rows(PLAYS, given)]
