"""The catalogue's items: put, seen, retired."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime

from app.domain import Item, Revision
from app.errors import Fault, ItemNotFound, UnknownModel
from app.storage import audit, items, models, revision
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class NewItem:
    """An item as a client describes it."""

    id: str
    model: str
    title: str = ""
    tags: Sequence[str] = ()
    payload: Mapping[str, object] = field(default_factory=dict)
    active: bool = True


def find(store: Store, item_id: str) -> Item:
    """An item, also a retired one."""
    item = items.by_id(store, item_id)
    if item is None:
        raise ItemNotFound(item_id)
    return item


def page(
    store: Store, after: str, limit: int, *, retired: bool, search: str = ""
) -> Sequence[Item]:
    return items.page(store, after, limit, retired=retired, search=search)


def put(store: Store, new: NewItem, by: str) -> tuple[Item, bool]:
    """Create or replace an item; tell whether it is new."""
    known = revision.current(store)
    present = items.by_id(store, new.id)
    if present is None:
        _check_model(store, new.model)
        return _create(store, known, new, by), True
    if same(new, described(present)):
        return present, False
    _check_model(store, new.model)
    return _replace(store, known, present, new, by), False


def retire(store: Store, item_id: str, by: str) -> None:
    """Recommend an item no more; what was learned of it is kept."""
    known = revision.current(store)
    present = find(store, item_id)
    if not present.active:
        return
    now = datetime.now(UTC)
    catalogue = revision.advance_catalogue(store, known, new_epoch=False)
    retired = replace(present, active=False, catalogue=catalogue, updated_at=now)
    items.replace(store, lambda: iter((retired,)))
    audit.note(store, now, by, "retire_item", item_id)


def described(item: Item) -> NewItem:
    """An item as its client would describe it."""
    return NewItem(
        item.id, item.model, item.title, item.tags, item.payload, item.active
    )


def same(one: NewItem, other: NewItem) -> bool:
    """Whether two descriptions are the same."""
    return (
        one.model == other.model
        and one.title == other.title
        and list(one.tags) == list(other.tags)
        and one.active == other.active
        and same_json(one.payload, other.payload)
    )


def same_json(one: Mapping[str, object], other: Mapping[str, object]) -> bool:
    """Whether two objects are the same JSON; in Python, 1 equals 1.0 and True."""
    return one == other and _canonical(one) == _canonical(other)


def _canonical(plain: Mapping[str, object]) -> str:
    return json.dumps(plain, sort_keys=True)


def _check_model(store: Store, model: str) -> None:
    found = models.latest(store, model)
    if found is None or found.retired:
        raise UnknownModel(
            f"There is no model {model!r}.", Fault("model", "unknown", model)
        )


def _create(store: Store, known: Revision, new: NewItem, by: str) -> Item:
    now = datetime.now(UTC)
    item = Item(
        serial=items.next_serial(store),
        id=new.id,
        model=new.model,
        title=new.title,
        tags=new.tags,
        payload=new.payload,
        active=new.active,
        catalogue=revision.advance_catalogue(store, known, new_epoch=False),
        created_at=now,
        updated_at=now,
    )
    items.insert(store, lambda: iter((item,)))
    audit.note(store, now, by, "create_item", item.id)
    return item


def _replace(
    store: Store, known: Revision, present: Item, new: NewItem, by: str
) -> Item:
    """Another model gives the beliefs of those who played it a new meaning."""
    now = datetime.now(UTC)
    item = replace(
        present,
        model=new.model,
        title=new.title,
        tags=new.tags,
        payload=new.payload,
        active=new.active,
        catalogue=revision.advance_catalogue(
            store, known, new_epoch=new.model != present.model
        ),
        updated_at=now,
    )
    items.replace(store, lambda: iter((item,)))
    audit.note(store, now, by, "replace_item", item.id)
    return item
