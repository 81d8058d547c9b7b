"""Item models. A version once written never changes."""

from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa

from app.domain import ItemModel
from app.storage.store import Store
from app.storage.tables import items, models

INSERT = models.insert()
VERSIONS = (
    sa.select(models)
    .where(models.c.id == sa.bindparam("model"))
    .order_by(models.c.version.desc())
)
AT = (
    sa.select(models)
    .where(models.c.catalogue <= sa.bindparam("catalogue"))
    .order_by(models.c.id, models.c.version)
)
USERS = (
    sa.select(sa.func.count())
    .select_from(items)
    .where(items.c.model == sa.bindparam("model"))
)


def insert(store: Store, model: ItemModel) -> None:
    store.write(
        INSERT,
        {
            "id": model.id,
            "version": model.version,
            "states": model.states,
            "play": model.play,
            "rest": model.rest,
            "like": model.like,
            "prior": model.prior,
            "source": model.source,
            "created_at": model.created_at,
            "catalogue": model.catalogue,
            "retired": model.retired,
        },
    )


def versions(store: Store, model: str) -> Sequence[ItemModel]:
    """All versions of a model, the latest first."""
    return [_model(row) for row in store.rows(VERSIONS, {"model": model})]


def at(store: Store, catalogue: int) -> Sequence[ItemModel]:
    """The version of each model that a catalogue held, in order of id."""
    rows = store.rows(AT, {"catalogue": catalogue})
    latest = {row.id: _model(row) for row in rows}
    return [model for model in latest.values() if not model.retired]


def count_items(store: Store, model: str) -> int:
    """How many items, also retired ones, move by this model."""
    row = store.row(USERS, {"model": model})
    return 0 if row is None else int(row[0])


def _model(row: sa.Row[Any]) -> ItemModel:
    return ItemModel(**row._mapping)  # noqa: SLF001 - its public name in SQLAlchemy
