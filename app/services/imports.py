"""Import of items: all lines of a file in one unit of work, or none."""

import asyncio
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial

from app.domain import Item
from app.errors import Fault, InvalidImport
from app.services.catalogue import Catalogue
from app.services.changes import Change, Imported
from app.services.items import NewItem, same
from app.services.lines import Faults, LineFile
from app.services.live import Live
from app.services.staging import Staging
from app.storage import audit, items, revision
from app.storage.database import Database
from app.storage.store import Store

FIELDS = ("id", "model", "title", "tags", "payload", "active")


@dataclass(slots=True)
class Plan:
    """What becomes of each entry of a file, in the catalogue of one revision.

    serial:  of each entry
    change:  of each entry
    retired: serials of items that the file does not name
    moved:   an item goes to another model
    """

    serial: "array[int]" = field(default_factory=lambda: array("q"))
    change: bytearray = field(default_factory=bytearray)
    retired: list[int] = field(default_factory=list)
    moved: bool = False
    faults: Faults = field(default_factory=Faults)

    def result(self, *, dry_run: bool) -> Imported:
        created, replaced, unchanged = map(self.change.count, Change)
        return Imported(created, replaced, unchanged, len(self.retired), dry_run)


async def import_items(
    database: Database,
    live: Live,
    file: LineFile[NewItem],
    *,
    by: str,
    dry_run: bool = False,
    retire_missing: bool = False,
) -> Imported:
    """Create and replace the items of a file; retire, if asked, all others."""
    faults = file.faults()
    with Staging(FIELDS, NewItem) as staged:
        await asyncio.to_thread(_stage, file, staged, faults)
        if retire_missing and len(staged) == 0:
            faults.refuse()
            raise InvalidImport("The file names no item: that would retire them all.")
        land = partial(
            _land,
            live=live,
            staged=staged,
            faults=faults,
            retire_missing=retire_missing,
            by=None if dry_run else by,
        )
        return await database.run_in_turn(land)


def _stage(file: LineFile[NewItem], staged: Staging[NewItem], faults: Faults) -> None:
    seen: dict[str, int] = {}
    for line, item in file.entries(faults):
        first = seen.setdefault(item.id, line)
        if first == line:
            staged.add(line, item)
        else:
            faults.add(line, Fault("id", f"is also on line {first}", item.id))


def _land(
    store: Store,
    live: Live,
    staged: Staging[NewItem],
    faults: Faults,
    *,
    retire_missing: bool,
    by: str | None,
) -> Imported:
    known = revision.current(store)
    catalogue = live.catalogue(store, known)
    plan = store.aside(partial(_plan, catalogue, staged, retire_missing=retire_missing))
    faults.and_those(plan.faults).refuse()
    result = plan.result(dry_run=by is None)
    if by is not None and result.created + result.replaced + result.retired > 0:
        now = datetime.now(UTC)
        number = revision.advance_catalogue(store, known, new_epoch=plan.moved)
        _write(store, catalogue, staged, plan, _Stamp(number, now))
        detail = {"created": result.created, "replaced": result.replaced}
        detail["retired"] = result.retired
        audit.note(store, now, by, "import_items", "items", detail)
    return result


def _plan(
    catalogue: Catalogue, staged: Staging[NewItem], *, retire_missing: bool
) -> Plan:
    plan = Plan()
    models = {model.id for model in catalogue.versions}
    upcoming = len(catalogue.listing.shelf)
    for line, item in zip(staged.lines, staged, strict=True):
        if item.model not in models:
            message = f"unknown model {item.model!r}"
            plan.faults.add(line, Fault("model", message, item.model))
        serial = catalogue.serial_of(item.id)
        if serial is None:
            plan.serial.append(upcoming)
            plan.change.append(Change.CREATED)
            upcoming += 1
            continue
        present = _present(catalogue, serial)
        plan.serial.append(serial)
        plan.change.append(Change.UNCHANGED if same(item, present) else Change.REPLACED)
        plan.moved |= item.model != present.model
    if retire_missing:
        named = set(plan.serial)
        active = catalogue.pool.serials.tolist()
        plan.retired = [serial for serial in active if serial not in named]
    return plan


@dataclass(frozen=True, slots=True)
class _Stamp:
    """In which catalogue, and when, a change took place."""

    catalogue: int
    at: datetime

    def item(self, serial: int, new: NewItem) -> Item:
        return Item(
            serial=serial,
            id=new.id,
            model=new.model,
            title=new.title,
            tags=new.tags,
            payload=new.payload,
            active=new.active,
            catalogue=self.catalogue,
            created_at=self.at,
            updated_at=self.at,
        )


def _write(
    store: Store,
    catalogue: Catalogue,
    staged: Staging[NewItem],
    plan: Plan,
    stamp: _Stamp,
) -> None:
    def changed(wanted: Change) -> Iterator[Item]:
        rows = zip(staged, plan.serial, plan.change, strict=True)
        return (stamp.item(serial, new) for new, serial, to in rows if to == wanted)

    def retired() -> Iterator[Item]:
        for serial in plan.retired:
            yield stamp.item(serial, replace(_present(catalogue, serial), active=False))

    items.insert(store, partial(changed, Change.CREATED))
    items.replace(store, partial(changed, Change.REPLACED))
    items.replace(store, retired)


def _present(catalogue: Catalogue, serial: int) -> NewItem:
    """An item of the catalogue as a client would describe it."""
    shelf, listing = catalogue.shelf(serial), catalogue.listing
    return NewItem(
        shelf.id,
        listing.model[serial],
        shelf.title,
        shelf.tags,
        shelf.payload,
        listing.active[serial],
    )
