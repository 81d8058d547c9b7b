"""What is held about a user: beliefs, history, all of it, or nothing any more."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain import Play, User
from app.errors import UserNotFound
from app.services import beliefs, moods
from app.services.catalogue import Shelf
from app.services.live import Live
from app.services.moods import Mood
from app.services.standing import Standing
from app.storage import audit, plays, revision, users
from app.storage.plays import Position
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class ItemBelief:
    """What is believed of a user's interest in one item, in the user's slot.

    belief: probability of each state
    like:   expected reward
    rested: slots since it was played, None if never (or too long ago to matter)
    """

    item: str
    model: str
    states: Sequence[str]
    belief: Sequence[float]
    like: float
    rested: int | None


@dataclass(frozen=True, slots=True)
class Interest:
    """A page of a user's beliefs.

    mood: of the user's next play, None where no model has one
    next: serial with which the next page starts
    """

    slot: int
    mood: Mood | None
    beliefs: Sequence[ItemBelief]
    next: int | None


@dataclass(frozen=True, slots=True)
class History:
    """A page of a user's closed plays, the latest first. `next`: where it ended."""

    plays: Sequence[tuple[Play, Shelf]]
    next: Position | None


def interest(
    store: Store, live: Live, user_id: str, start: int, limit: int
) -> Interest:
    """The beliefs of the items that a user has played."""
    standing = _standing(store, live, user_id)
    later = standing.entries.serial[standing.entries.serial >= start]
    shown = later[:limit].tolist()
    found = [_of_item(standing, serial) for serial in shown]
    more = int(later[limit]) if len(later) > limit else None
    return Interest(standing.slot, _mood(standing), found, more)


def interest_in(
    store: Store, live: Live, user_id: str, items: Sequence[str]
) -> Interest:
    """The beliefs of named items, also of those never played."""
    standing = _standing(store, live, user_id)
    serials = [standing.catalogue.known_serial(item) for item in items]
    found = [_of_item(standing, serial) for serial in serials]
    return Interest(standing.slot, _mood(standing), found, None)


def history(
    store: Store, live: Live, user_id: str, before: Position, limit: int
) -> History:
    """The closed plays of a user, before a position."""
    catalogue = live.catalogue(store, revision.current(store))
    found = plays.page(store, user_id, before, limit + 1)
    shown = [(play, catalogue.shelf(play.item)) for play in found[:limit]]
    last = found[limit - 1] if len(found) > limit else None
    return History(shown, None if last is None else (last.closed or 0, last.place))


@dataclass(frozen=True, slots=True)
class Holding:
    """All that is held about a user."""

    user: User
    mood: Mood | None
    beliefs: Sequence[ItemBelief]
    plays: Sequence[tuple[Play, Shelf]]


def export(store: Store, live: Live, user_id: str) -> Holding:
    """All that is held about a user, as one piece."""
    standing = _standing(store, live, user_id)
    if standing.user.version == 0:
        raise UserNotFound(user_id)
    held = [_of_item(standing, serial) for serial in standing.entries.serial.tolist()]
    shelf = standing.catalogue.shelf
    pending = standing.user.pending
    waiting = () if pending is None else pending.waiting
    closed = plays.every(store, user_id, before=standing.user.slot)
    log = [*reversed(list(closed)), *waiting]
    shown = [(play, shelf(play.item)) for play in log]
    return Holding(standing.user, _mood(standing), held, shown)


def erase(store: Store, user_id: str, by: str) -> None:
    """Forget a user; the act is kept, without the name.

    What a count of an experiment's plays has just read of the user is not written.
    """
    revision.advance_tallies(store, revision.tallies(store))
    _, user = users.by_id(store, user_id)
    if user.version == 0:
        raise UserNotFound(user_id)
    users.forget(store, user)
    audit.note(store, datetime.now(UTC), by, "erase_user", "")


def _standing(store: Store, live: Live, user_id: str) -> Standing:
    in_force, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, in_force)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    standing.keep_time(in_force.clock)
    return standing


def _mood(standing: Standing) -> Mood | None:
    return moods.described(standing.catalogue.models, standing.felt())


def _of_item(standing: Standing, serial: int) -> ItemBelief:
    catalogue = standing.catalogue
    belief, rested = beliefs.of_item(catalogue, standing.entries, standing.slot, serial)
    model = catalogue.model_of(serial)
    return ItemBelief(
        item=catalogue.shelf(serial).id,
        model=model.id,
        states=model.states,
        belief=catalogue.models.by_state(catalogue.row_of(serial), belief).tolist(),
        like=standing.expected(serial, standing.slot),
        rested=rested,
    )
