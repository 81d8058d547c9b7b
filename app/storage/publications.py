"""Models that were published through the gate, in order."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa

from app.domain import Publication
from app.storage.prepared import Row
from app.storage.records import columns
from app.storage.store import Store
from app.storage.tables import publications

INSERT = publications.insert()
UNDO = (
    publications.update()
    .where(publications.c.number == sa.bindparam("which"))
    .values(undone_at=sa.bindparam("moment"), undone_by=sa.bindparam("who"))
)
PAGE = (
    sa.select(publications)
    .where(publications.c.number < sa.bindparam("before"))
    .order_by(publications.c.number.desc())
    .limit(sa.bindparam("limit"))
)
STANDING = (
    sa.select(publications)
    .where(publications.c.undone_at.is_(None))
    .order_by(publications.c.number.desc())
    .limit(1)
)
LATEST = sa.select(sa.func.coalesce(sa.func.max(publications.c.number), 0))


def insert(store: Store, publication: Publication) -> None:
    store.write(INSERT, columns(publication))


def undo(store: Store, number: int, at: datetime, by: str) -> None:
    store.write(UNDO, {"which": number, "moment": at, "who": by})


def page(store: Store, before: int, limit: int) -> Sequence[Publication]:
    """Publications before a number, the latest first."""
    rows = store.rows(PAGE, {"before": before, "limit": limit})
    return [_publication(row) for row in rows]


def standing(store: Store) -> Publication | None:
    """The latest that was not taken back."""
    row = store.row(STANDING)
    return None if row is None else _publication(row)


def latest(store: Store) -> int:
    """The number of the latest, 0: there is none."""
    row = store.row(LATEST)
    return 0 if row is None else int(row[0])


def _publication(row: Row) -> Publication:
    return Publication(**row._asdict())
