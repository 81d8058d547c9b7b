"""The catalogue's items, and what each was in every catalogue before this one."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

import sqlalchemy as sa

from app.domain import Item
from app.storage.prepared import Row
from app.storage.records import columns
from app.storage.store import Store
from app.storage.tables import item_history, items

INSERT = items.insert()
REPLACE = (
    items.update()
    .where(items.c.serial == sa.bindparam("of"))
    .values(
        model=sa.bindparam("to_model"),
        title=sa.bindparam("to_title"),
        tags=sa.bindparam("to_tags"),
        payload=sa.bindparam("to_payload"),
        active=sa.bindparam("to_active"),
        catalogue=sa.bindparam("in_catalogue"),
        updated_at=sa.bindparam("at"),
    )
)
MOVE = (
    items.update()
    .where(items.c.serial == sa.bindparam("of"))
    .values(
        model=sa.bindparam("to_model"),
        catalogue=sa.bindparam("in_catalogue"),
        updated_at=sa.bindparam("at"),
    )
)
REMEMBER = item_history.insert()
BY_ID = sa.select(items).where(items.c.id == sa.bindparam("item"))
NEXT_SERIAL = sa.select(sa.func.coalesce(sa.func.max(items.c.serial) + 1, 0))
CHANGED = (
    sa.select(items)
    .where(items.c.catalogue > sa.bindparam("since"))
    .where(items.c.serial > sa.bindparam("after"))
    .order_by(items.c.serial)
    .limit(sa.bindparam("limit"))
)
PAGE = (
    sa.select(items)
    .where(items.c.id > sa.bindparam("after"))
    .order_by(items.c.id)
    .limit(sa.bindparam("limit"))
)
ACTIVE_PAGE = PAGE.where(items.c.active)
LIKE = sa.bindparam("like", type_=sa.Text)
NAMED = sa.or_(
    items.c.id.ilike(LIKE, escape="/"), items.c.title.ilike(LIKE, escape="/")
)
SEARCHED, ACTIVE_SEARCHED = PAGE.where(NAMED), ACTIVE_PAGE.where(NAMED)
SPECIAL = re.compile("[/%_]")  # in patterns
FORMER = item_history.alias()
LATEST = (
    sa.select(sa.func.max(FORMER.c.catalogue))
    .where(
        FORMER.c.serial == items.c.serial,
        FORMER.c.catalogue <= sa.bindparam("catalogue"),
    )
    .correlate(items)
    .scalar_subquery()
)
BEFORE = (
    sa.select(
        items.c.serial,
        items.c.id,
        item_history.c.model,
        item_history.c.tags,
        item_history.c.active,
    )
    .select_from(items)
    .outerjoin(
        item_history,
        sa.and_(
            item_history.c.serial == items.c.serial,
            item_history.c.catalogue == LATEST,
        ),
    )
    .where(items.c.catalogue > sa.bindparam("catalogue"))
    .where(items.c.serial > sa.bindparam("after"))
    .order_by(items.c.serial)
    .limit(sa.bindparam("limit"))
)
EARLIER = item_history.alias()
MOVED = (
    sa.select(items.c.serial, EARLIER.c.model)
    .select_from(items)
    .join(
        item_history,
        sa.and_(
            item_history.c.serial == items.c.serial,
            item_history.c.catalogue == sa.bindparam("moved_in"),
            item_history.c.model == items.c.model,
        ),
    )
    .join(
        EARLIER,
        sa.and_(EARLIER.c.serial == items.c.serial, EARLIER.c.catalogue == LATEST),
    )
    .where(items.c.serial > sa.bindparam("after"))
    .order_by(items.c.serial)
    .limit(sa.bindparam("limit"))
)
SIZE = 500


@dataclass(frozen=True, slots=True)
class Move:
    """An item that goes to another model; the rest of it stays."""

    serial: int
    model: str
    tags: Sequence[str]
    active: bool


def insert(store: Store, new: Callable[[], Iterator[Item]]) -> None:
    store.write_many(INSERT, lambda: (columns(item) for item in new()))
    store.write_many(REMEMBER, lambda: (_history(item) for item in new()))


def replace(store: Store, changed: Callable[[], Iterator[Item]]) -> None:
    store.write_many(REPLACE, lambda: (_replacement(item) for item in changed()))
    store.write_many(REMEMBER, lambda: (_history(item) for item in changed()))


def move(store: Store, moves: Sequence[Move], catalogue: int, at: datetime) -> None:
    """Note that items go to other models."""
    stamp = {"in_catalogue": catalogue, "at": at}
    store.write_many(
        MOVE,
        lambda: (
            {"of": move.serial, "to_model": move.model, **stamp} for move in moves
        ),
    )
    store.write_many(
        REMEMBER, lambda: (asdict(move) | {"catalogue": catalogue} for move in moves)
    )


def moved_in(store: Store, catalogue: int) -> Iterator[tuple[int, str]]:
    """Items that have the model still to which they went in a catalogue.

    Serial, and the model that each had before.
    """
    after = -1
    past = {"moved_in": catalogue, "catalogue": catalogue - 1, "limit": SIZE}
    while rows := store.rows(MOVED, {**past, "after": after}):
        yield from ((row.serial, row.model) for row in rows)
        after = rows[-1].serial
        store.pause()


def by_id(store: Store, item: str) -> Item | None:
    row = store.row(BY_ID, {"item": item})
    return None if row is None else _item(row)


def next_serial(store: Store) -> int:
    """The serial of the next new item, for a unit that claims the catalogue."""
    row = store.row(NEXT_SERIAL)
    return 0 if row is None else int(row[0])


def page(
    store: Store, after: str, limit: int, *, retired: bool = False, search: str = ""
) -> Sequence[Item]:
    """Items in order of id; `search`: those that have it in their id or title."""
    params: dict[str, object] = {"after": after, "limit": limit}
    if search:
        statement = SEARCHED if retired else ACTIVE_SEARCHED
        params["like"] = f"%{SPECIAL.sub(_escaped, search)}%"
    else:
        statement = PAGE if retired else ACTIVE_PAGE
    return [_item(row) for row in store.rows(statement, params)]


def _escaped(special: re.Match[str]) -> str:
    return f"/{special[0]}"


def changed(store: Store, since: int) -> Iterator[Item]:
    """Items that changed after a catalogue, in order of serial."""
    after = -1
    while some := in_order(store, since=since, after=after):
        yield from some
        after = some[-1].serial
        store.pause()


def in_order(store: Store, *, since: int = -1, after: int = -1) -> Sequence[Item]:
    """The next few items after a serial, those that changed after a catalogue."""
    rows = store.rows(CHANGED, {"since": since, "after": after, "limit": SIZE})
    return [_item(row) for row in rows]


def before(store: Store, catalogue: int) -> Iterator[Row]:
    """Serial, id, model, tags and active, in a catalogue, of items changed since.

    Of an item that did not exist then, model, tags and active are None.
    """
    after = -1
    while rows := store.rows(
        BEFORE, {"catalogue": catalogue, "after": after, "limit": SIZE}
    ):
        yield from rows
        after = rows[-1].serial
        store.pause()


def _item(row: Row) -> Item:
    return Item(**row._asdict())


def _replacement(item: Item) -> Mapping[str, object]:
    return {
        "of": item.serial,
        "to_model": item.model,
        "to_title": item.title,
        "to_tags": item.tags,
        "to_payload": item.payload,
        "to_active": item.active,
        "in_catalogue": item.catalogue,
        "at": item.updated_at,
    }


def _history(item: Item) -> Mapping[str, object]:
    return {
        "serial": item.serial,
        "catalogue": item.catalogue,
        "model": item.model,
        "tags": item.tags,
        "active": item.active,
    }
