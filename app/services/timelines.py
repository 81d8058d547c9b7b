"""How interest in one item has moved: its belief in each slot, from the log."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from operator import attrgetter

from app.errors import ItemNotFound
from app.services import beliefs, moods
from app.services.catalogue import Catalogue
from app.services.live import Live
from app.services.standing import Standing
from app.storage import plays, users
from app.storage.packing import Entries, Felt
from app.storage.plays import ClosedPlay
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class Moment:
    """What was believed of one item as a slot began.

    belief:  probability of each state
    like:    expected reward, in the mood of the slot
    rested:  slots since it was played, None if never (or too long ago to matter)
    signals: answers to its plays in this slot; none if it rested
    """

    slot: int
    belief: Sequence[float]
    like: float
    rested: int | None
    signals: Sequence[str]


@dataclass(frozen=True, slots=True)
class Timeline:
    """The belief of one item by the models in force, slot after slot until now."""

    model: str
    states: Sequence[str]
    moments: Sequence[Moment]


def of_item(store: Store, live: Live, user_id: str, item: str, slots: int) -> Timeline:
    """The timeline of an item for a user: the slots before now, then the present.

    It begins later where plays that it would follow from were dropped.
    """
    revision, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, revision)
    serial = catalogue.serial_of(item)
    if serial is None:
        raise ItemNotFound(item)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    standing.keep_time(revision.clock)
    _, known_from = users.kept(store, user_id)
    first = max(standing.slot - slots, min(known_from, standing.slot), 0)
    log = plays.closed(store, user_id, before=standing.slot)
    past = store.aside(partial(_past, catalogue, log, first, standing.slot, serial))
    now = _moment(catalogue, standing.entries, standing.felt(), standing.slot, serial)
    model = catalogue.model_of(serial)
    return Timeline(model.id, model.states, (*past, now))


def _past(
    catalogue: Catalogue, log: Sequence[ClosedPlay], first: int, end: int, serial: int
) -> list[Moment]:
    before = [play for play in log if play.slot < first]
    entries = beliefs.rebuilt(catalogue, before, first)
    later = groupby(log[len(before) :], key=attrgetter("slot"))
    played = {slot: list(together) for slot, together in later}
    moments = []
    for slot in range(first, end):
        here, felt = played.get(slot, []), entries.felt
        if here:
            felt = moods.begun(catalogue, felt, slot, here[0].created_at)
        signals = [play.signal for play in here if play.item == serial]
        moments.append(_moment(catalogue, entries, felt, slot, serial, signals))
        for play in here:
            entries, _ = beliefs.after_play(catalogue, entries, play)
        entries = beliefs.without_forgotten(catalogue, entries, slot + 1)
    return moments


def _moment(
    catalogue: Catalogue,
    entries: Entries,
    felt: Felt | None,
    slot: int,
    serial: int,
    signals: Sequence[str] = (),
) -> Moment:
    belief, rested = beliefs.of_item(catalogue, entries, slot, serial)
    mood = moods.class_of(catalogue.models, felt)
    return Moment(
        slot=slot,
        belief=catalogue.models.by_state(catalogue.row_of(serial), belief).tolist(),
        like=beliefs.expected(catalogue, serial, belief, mood),
        rested=rested,
        signals=signals,
    )
