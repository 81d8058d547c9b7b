"""Index tables: built, stored, and at hand for the policies that look scores up.

A table is in use from the catalogue with whose number it was stored: the tables behind
a decision are known by the catalogue from which it was taken.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial

from app.domain import ItemModel, Precision
from app.errors import NotReady
from app.services.catalogue import Catalogue
from app.services.mathematics import stacked
from app.storage import index_tables
from app.storage.index_packing import pack, unpack
from app.storage.index_tables import TableKey, TableRecord
from app.storage.store import Store
from policies import IndexTable, build

ROUGH_POINTS = 300

AtHand = Mapping[TableKey, IndexTable]
NOTHING: AtHand = {}


@dataclass(frozen=True, slots=True, eq=False)
class Built:
    """A table that is not stored yet; its catalogue is stamped when it is."""

    record: TableRecord
    packed: bytes


def rough(model: ItemModel, sample: int, discount: float) -> Built:
    """Build a small table, in some ten milliseconds."""
    began = time.perf_counter()
    table = build(stacked([model]).separated(), sample, discount, ROUGH_POINTS)
    return _built(model, sample, Precision.ROUGH, table, began)


def full(
    model: ItemModel, sample: int, discount: float, progress: Callable[[float], object]
) -> Built:
    """Build a table as fine as it gets, in about a second."""
    began = time.perf_counter()
    chains = stacked([model]).separated()
    table = build(chains, sample, discount, progress=progress)
    return _built(model, sample, Precision.FULL, table, began)


def insert(store: Store, built: Iterable[Built], catalogue: int) -> None:
    """Note tables to be stored, and used from this catalogue on."""
    for table in built:
        record = replace(table.record, catalogue=catalogue)
        index_tables.insert(store, record, table.packed)


def followed(
    tables: Iterable[TableKey],
    published: Iterable[TableKey],
    versions: Iterable[ItemModel],
) -> Sequence[TableKey]:
    """The finest tables of these models: those in use before, and those that came."""
    wanted = {(model.id, model.version) for model in versions}
    found: dict[tuple[str, int, float, int], TableKey] = {}
    for key in (*tables, *published):
        place = key.model, key.version, key.discount, key.sample
        better = place not in found or key.precision is Precision.FULL
        if better and (key.model, key.version) in wanted:
            found[place] = key
    return tuple(found.values())


def at_hand(
    store: Store, catalogue: Catalogue, discount: float | None, kept: AtHand
) -> AtHand:
    """The tables of models by row, and of their samples; those kept are not read."""
    if discount is None:
        return NOTHING
    in_use = {
        (key.model, key.version, key.sample): key
        for key in catalogue.tables
        if key.discount == discount
    }
    found: dict[TableKey, IndexTable] = {}
    wanted = [(each, k) for each in catalogue.versions for k in range(each.chains)]
    for model, sample in wanted:
        key = in_use.get((model.id, model.version, sample))
        if key is None:
            raise NotReady(
                f"The model {model.id!r} has no index table at discount {discount}."
            )
        found[key] = kept[key] if key in kept else _read(store, key)
    return found


def _read(store: Store, key: TableKey) -> IndexTable:
    found = index_tables.by_key(store, key)
    if found is None:
        raise LookupError(f"there is no index table {key}")
    record, packed = found
    whittle, value = store.aside(partial(unpack, packed))
    return IndexTable(
        states=record.states,
        discount=record.discount,
        divisions=record.divisions,
        whittle=whittle,
        value_divisions=record.value_divisions,
        value=value,
        low=record.low,
        high=record.high,
        reached=record.reached,
        unsettled=record.unsettled,
        unsettled_elsewhere=record.unsettled_elsewhere,
        error=record.error,
    )


def _built(
    model: ItemModel, sample: int, precision: Precision, table: IndexTable, began: float
) -> Built:
    packed = pack(table.whittle, table.value)
    record = TableRecord(
        model=model.id,
        version=model.version,
        discount=table.discount,
        precision=precision,
        sample=sample,
        catalogue=0,
        states=table.states,
        divisions=table.divisions,
        value_divisions=table.value_divisions,
        points=len(table.whittle),
        reached=table.reached,
        unsettled=table.unsettled,
        unsettled_elsewhere=table.unsettled_elsewhere,
        error=table.error,
        low=table.low,
        high=table.high,
        seconds=time.perf_counter() - began,
        built_at=datetime.now(UTC),
    )
    return Built(record, packed)
