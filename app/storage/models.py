"""Item models. A version once written never changes."""

from collections.abc import Sequence
from dataclasses import asdict

import sqlalchemy as sa

from app.domain import ItemModel, ItemMood, ItemSample, ItemSignals, MoodRule
from app.storage.prepared import Row
from app.storage.records import columns
from app.storage.store import Store
from app.storage.tables import items, models

INSERT = models.insert()
VERSIONS = (
    sa.select(models)
    .where(models.c.id == sa.bindparam("model"))
    .order_by(models.c.version.desc())
)
LATEST = VERSIONS.limit(1)
VERSION = sa.select(models).where(
    models.c.id == sa.bindparam("model"), models.c.version == sa.bindparam("version")
)
IDS = (
    sa.select(models.c.id, sa.func.max(models.c.version).label("version"))
    .where(models.c.id > sa.bindparam("after"))
    .group_by(models.c.id)
    .subquery()
)
PAGE = (
    sa.select(models)
    .join(IDS, sa.and_(models.c.id == IDS.c.id, models.c.version == IDS.c.version))
    .where(models.c.retired.is_(False))
    .order_by(models.c.id)
    .limit(sa.bindparam("limit"))
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
    signals = None if model.signals is None else asdict(model.signals)
    mood = None if model.mood is None else asdict(model.mood)
    samples = None
    if model.samples is not None:
        samples = [asdict(sample) for sample in model.samples]
    parts = {"signals": signals, "mood": mood, "samples": samples}
    store.write(INSERT, columns(model) | parts)


def latest(store: Store, model: str) -> ItemModel | None:
    """The latest version of a model, which may say that it is retired."""
    row = store.row(LATEST, {"model": model})
    return None if row is None else _model(row)


def version(store: Store, model: str, version: int) -> ItemModel | None:
    row = store.row(VERSION, {"model": model, "version": version})
    return None if row is None else _model(row)


def page(store: Store, after: str, limit: int) -> Sequence[ItemModel]:
    """The latest version of each model that is not retired, in order of id."""
    rows = store.rows(PAGE, {"after": after, "limit": limit})
    return [_model(row) for row in rows]


def at(store: Store, catalogue: int) -> Sequence[ItemModel]:
    """The version of each model that a catalogue held, in order of id."""
    rows = store.rows(AT, {"catalogue": catalogue})
    latest = {row.id: _model(row) for row in rows}
    return [model for model in latest.values() if not model.retired]


def count_items(store: Store, model: str) -> int:
    """How many items, also retired ones, move by this model."""
    row = store.row(USERS, {"model": model})
    return 0 if row is None else int(row[0])


def _model(row: Row) -> ItemModel:
    fields = row._asdict()
    if fields["signals"] is not None:
        fields["signals"] = ItemSignals(**fields["signals"])
    if fields["mood"] is not None:
        rule = MoodRule(**fields["mood"]["rule"])
        fields["mood"] = ItemMood(**fields["mood"] | {"rule": rule})
    if fields["samples"] is not None:
        fields["samples"] = [ItemSample(**sample) for sample in fields["samples"]]
    return ItemModel(**fields)
