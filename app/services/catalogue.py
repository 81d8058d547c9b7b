"""The catalogue as a snapshot in memory, and how it follows the database."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from app.domain import Item, ItemModel, Revision
from app.errors import Fault, UnknownItems
from app.services.mathematics import stacked
from app.services.pool import Pool
from app.storage.index_tables import TableKey
from policies import NONE, Ints, ModelSet

NO_ROW = -1
MOST_TAGGED = 256


@dataclass(frozen=True, slots=True)
class Shelf:
    """What a listener's client is told of an item."""

    id: str
    title: str
    tags: Sequence[str]
    payload: Mapping[str, object]


NOTHING = Shelf("", "", (), {})


@dataclass(slots=True)
class Listing:
    """The items of a catalogue, as they are gathered."""

    shelf: list[Shelf] = field(default_factory=list)
    serials: dict[str, int] = field(default_factory=dict)
    model: list[str] = field(default_factory=list)
    active: list[bool] = field(default_factory=list)

    def copy(self) -> "Listing":
        return Listing(
            self.shelf.copy(),
            self.serials.copy(),
            self.model.copy(),
            self.active.copy(),
        )

    def put(self, serial: int, shelf: Shelf, model: str, *, active: bool) -> None:
        missing = serial + 1 - len(self.shelf)
        if missing > 0:
            self.shelf.extend([NOTHING] * missing)
            self.model.extend([""] * missing)
            self.active.extend([False] * missing)
        self.shelf[serial] = shelf
        self.serials[shelf.id] = serial
        self.model[serial] = model
        self.active[serial] = active

    def put_item(self, item: Item) -> None:
        shelf = Shelf(item.id, item.title, item.tags, item.payload)
        self.put(item.serial, shelf, item.model, active=item.active)


@dataclass(frozen=True, slots=True, eq=False)
class Catalogue:
    """All items and models of one revision; items are known by their serial.

    version:  the revision of this snapshot
    epoch:    the revision in which beliefs last took on a new meaning
    listing:  the items
    versions: (M) each model as it is kept
    signals:  (M) number of each of a model's signals, by name
    tables:   the finest index tables of these models, at each discount
    models:   the same, stacked for compiled code
    model:    (N,) row of each item's model
    active:   (N,) whether an item may be recommended
    pool:     every active item
    tagged:   pools by tags, made when first asked for
    """

    version: int
    epoch: int
    listing: Listing
    versions: Sequence[ItemModel]
    signals: Sequence[Mapping[str, int]]
    tables: Sequence[TableKey]
    models: ModelSet
    model: Ints
    active: NDArray[np.bool_]
    pool: Pool
    tagged: dict[tuple[str, ...], Pool] = field(default_factory=dict)

    @classmethod
    def empty(cls) -> "Catalogue":
        return cls.build(Revision(-1, -1, 0), (), (), Listing(), ModelSet.of(()))

    @classmethod
    def build(
        cls,
        revision: Revision,
        versions: Sequence[ItemModel],
        tables: Sequence[TableKey],
        listing: Listing,
        models: ModelSet,
    ) -> "Catalogue":
        rows = {model.id: row for row, model in enumerate(versions)}
        model = np.array([rows.get(m, NO_ROW) for m in listing.model], np.int64)
        active = np.array(listing.active, np.bool_)
        pool = Pool.of(np.flatnonzero(active), model, len(versions))
        return cls(
            revision.catalogue,
            revision.epoch,
            listing,
            versions,
            [{name: k for k, name in enumerate(each.answers)} for each in versions],
            tables,
            models,
            model,
            active,
            pool,
        )

    def followed_by(
        self,
        revision: Revision,
        versions: Sequence[ItemModel],
        tables: Sequence[TableKey],
        listing: Listing,
    ) -> "Catalogue":
        """A later catalogue; what did not change is kept."""
        tables = self.tables if tables == self.tables else tables
        if versions != self.versions:
            models = stacked(versions)
            return Catalogue.build(revision, versions, tables, listing, models)
        if listing is not self.listing:
            return Catalogue.build(revision, versions, tables, listing, self.models)
        return replace(
            self, version=revision.catalogue, epoch=revision.epoch, tables=tables
        )

    def serial_of(self, item: str) -> int | None:
        return self.listing.serials.get(item)

    def known_serial(self, item: str) -> int:
        """Serial of an item that a request names."""
        serial = self.serial_of(item)
        if serial is None:
            fault = Fault("item", "unknown item", item)
            raise UnknownItems(f"There is no item {item!r}.", fault)
        return serial

    def shelf(self, serial: int) -> Shelf:
        return self.listing.shelf[serial]

    def model_of(self, serial: int) -> ItemModel:
        return self.versions[self.row_of(serial)]

    def row_of(self, serial: int) -> int:
        """Row of an item's model."""
        return int(self.model[serial])

    def signal_of(self, serial: int, name: str) -> int:
        """Number of a signal in an item's model; one that it does not have is none."""
        return self.signals[self.row_of(serial)].get(name, NONE)

    def with_tags(self, tags: tuple[str, ...]) -> Pool:
        """Active items that carry every tag."""
        wanted = tuple(sorted(set(tags)))
        if not wanted:
            return self.pool
        if wanted not in self.tagged:
            matching = [
                serial
                for serial, shelf in enumerate(self.listing.shelf)
                if shelf.tags and set(wanted) <= set(shelf.tags)
            ]
            serials = np.array(matching, np.int64)
            serials = serials[self.active[serials]]
            if len(self.tagged) >= MOST_TAGGED:
                self.tagged.clear()
            self.tagged[wanted] = Pool.of(serials, self.model, len(self.versions))
        return self.tagged[wanted]
