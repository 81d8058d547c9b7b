"""Index tables. One once written never changes: a finer one is another row."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from app.domain import Precision
from app.storage.prepared import Row
from app.storage.store import Store
from app.storage.tables import index_tables


@dataclass(frozen=True, slots=True)
class TableKey:
    """Which table: of a version of a model, or of one of its samples, at a discount."""

    model: str
    version: int
    discount: float
    precision: Precision
    sample: int = 0


@dataclass(frozen=True, slots=True)
class TableRecord:
    """What is told of a table; for its figures see `policies.IndexTable`.

    catalogue: the catalogue from which it is in use
    points:    of the grid of the index
    seconds:   that it took to build
    """

    model: str
    version: int
    discount: float
    precision: Precision
    sample: int
    catalogue: int
    states: int
    divisions: int
    value_divisions: int
    points: int
    reached: int
    unsettled: int
    unsettled_elsewhere: int
    error: float
    low: float
    high: float
    seconds: float
    built_at: datetime

    @property
    def key(self) -> TableKey:
        return TableKey(
            self.model, self.version, self.discount, self.precision, self.sample
        )

    @property
    def indexable(self) -> bool:
        """Whether the model is, as far as the grid can tell."""
        return self.unsettled == 0


KEY = (
    index_tables.c.model,
    index_tables.c.version,
    index_tables.c.discount,
    index_tables.c.precision,
    index_tables.c.sample,
)
RECORD = [column for column in index_tables.c if column.name != "packed"]
THIS = sa.and_(*(column == sa.bindparam(f"the_{column.name}") for column in KEY))
INSERT = index_tables.insert()
DELETE = index_tables.delete().where(THIS)
BY_KEY = sa.select(index_tables).where(THIS)
PUBLISHED = (
    sa.select(*KEY)
    .where(index_tables.c.catalogue > sa.bindparam("after"))
    .where(index_tables.c.catalogue <= sa.bindparam("until"))
)
AT_DISCOUNT = sa.select(*RECORD).where(
    index_tables.c.discount == sa.bindparam("discount")
)
KEYS = sa.select(*KEY)


def insert(store: Store, record: TableRecord, packed: bytes) -> None:
    row = {column.name: getattr(record, column.name) for column in RECORD}
    store.write(INSERT, row | {"packed": packed})


def delete(store: Store, key: TableKey) -> None:
    store.write(DELETE, _this(key))


def by_key(store: Store, key: TableKey) -> tuple[TableRecord, bytes] | None:
    """A table with its numbers."""
    row = store.row(BY_KEY, _this(key))
    return None if row is None else (_record(row), row.packed)


def published(store: Store, after: int, until: int) -> Sequence[TableKey]:
    """The tables that came into use after a catalogue, until another one."""
    return [
        _key(row) for row in store.rows(PUBLISHED, {"after": after, "until": until})
    ]


def at_discount(store: Store, discount: float) -> Sequence[TableRecord]:
    """All tables at a discount, also those of earlier versions of models."""
    return [_record(row) for row in store.rows(AT_DISCOUNT, {"discount": discount})]


def keys(store: Store) -> Sequence[TableKey]:
    """All tables there are."""
    return [_key(row) for row in store.rows(KEYS)]


def _this(key: TableKey) -> Mapping[str, object]:
    return {f"the_{column.name}": getattr(key, column.name) for column in KEY}


def _key(row: Row) -> TableKey:
    precision = Precision(row.precision)
    return TableKey(row.model, row.version, row.discount, precision, row.sample)


def _record(row: Row) -> TableRecord:
    told = {column.name: getattr(row, column.name) for column in RECORD}
    return TableRecord(**told | {"precision": Precision(row.precision)})
