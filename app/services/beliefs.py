"""What is believed of a user's interest: kept for played items, stepped on read.

An item leaves once its belief is as good as that of an item never played, and it has
rested so long that no policy cares when it was played last. So a user who has played
ten thousand items costs no more than one who has played a few.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.domain import User
from app.services import moods
from app.services.catalogue import Catalogue
from app.storage import plays
from app.storage.packing import Entries, unpack
from app.storage.plays import ClosedPlay
from app.storage.store import Store
from policies import (
    REMEMBERED,
    Answered,
    Floats,
    Ints,
    answered,
    expected_like,
    replayed,
    rested,
    returned,
    untouched,
)


@dataclass(frozen=True, slots=True, eq=False)
class Beliefs:
    """A user's played items, with their beliefs in one slot.

    serial:   (K,) items, ascending
    rested:   (K,) slots since each was played
    belief:   (K, S)
    returned: (K,) whether interest has returned to that of an item never played
    fresh:    (M, S) the belief of an item never played, by model
    """

    serial: Ints
    rested: Ints
    belief: Floats
    returned: NDArray[np.bool_]
    fresh: Floats

    @property
    def forgotten(self) -> NDArray[np.bool_]:
        return self.returned & (self.rested >= REMEMBERED)


class Heard(NamedTuple):
    """A closed play of one item, and the class of the mood that it was in."""

    slot: int
    signal: str
    mood: int


def kept(store: Store, catalogue: Catalogue, user: User) -> Entries:
    """A user's entries; those of an earlier epoch are rebuilt from the log of plays."""
    states = catalogue.models.like.shape[1]
    moody = catalogue.models.classes > 1
    if user.slot == 0:
        return replace(Entries.none(states), felt=moods.unfelt(catalogue))
    if user.epoch == catalogue.epoch:
        entries = unpack(user.packed, states)
        if moody == (entries.felt is not None):
            return entries
        if not moody:
            return replace(entries, felt=None)
    log = plays.closed(store, user.id, before=user.slot)
    return store.aside(partial(rebuilt, catalogue, log, user.settled))


def rebuilt(catalogue: Catalogue, log: Sequence[ClosedPlay], settled: int) -> Entries:
    """The entries that a log of plays gives rise to; before `settled` all is closed."""
    classes, felt = np.zeros(len(log), np.int64), None
    if catalogue.models.classes > 1:
        classes, felt = moods.rebuilt(catalogue, log)
    by_item: dict[int, list[Heard]] = {}
    for play, mood in zip(log, classes.tolist(), strict=True):
        heard = Heard(play.slot, play.signal, mood)
        by_item.setdefault(play.item, []).append(heard)
    serials = sorted(by_item)
    final = [
        _replay(catalogue, serial, _remembered(catalogue, serial, by_item[serial]))
        for serial in serials
    ]
    entries = Entries(
        np.array(serials, np.int64),
        np.array([slot for slot, _ in final], np.int64),
        np.array([belief for _, belief in final], np.float64).reshape(
            len(serials), catalogue.models.like.shape[1]
        ),
        felt,
    )
    return without_forgotten(catalogue, entries, settled)


def at(catalogue: Catalogue, entries: Entries, slot: int) -> Beliefs:
    """The beliefs of a slot: each played item has rested since it was played."""
    model = catalogue.model[entries.serial]
    slots = slot - entries.slot
    belief = rested(catalogue.models, model, entries.belief, slots)
    fresh = untouched(catalogue.models, slot)
    back = returned(belief, fresh[model])
    return Beliefs(entries.serial, slots, belief, back, fresh)


def of_item(
    catalogue: Catalogue, entries: Entries, slot: int, serial: int
) -> tuple[Floats, int | None]:
    """The belief of one item, and the slots it has rested (None: never played)."""
    row = _row(entries, serial)
    model = np.array([catalogue.row_of(serial)])
    if row is None:
        return untouched(catalogue.models, slot)[model[0]], None
    slots = slot - entries.slot[row : row + 1]
    belief = rested(catalogue.models, model, entries.belief[row : row + 1], slots)
    return belief[0], int(slots[0])


def expected(catalogue: Catalogue, serial: int, belief: Floats, mood: int) -> float:
    """The expected reward in a mood: with skip and like, chance of a like."""
    model = np.array([catalogue.row_of(serial)])
    return float(expected_like(catalogue.models, model, belief[None], mood)[0])


def after_play(
    catalogue: Catalogue, entries: Entries, play: ClosedPlay
) -> tuple[Entries, Answered]:
    """The entries after a play, and what its answer taught."""
    slot, serial = play.slot, play.item
    felt = moods.after(catalogue, entries.felt, play)
    row, known = _row(entries, serial), entries
    if row is not None and slot - entries.slot[row] >= REMEMBERED:
        known = without_forgotten(catalogue, _rows(entries, np.array([row])), slot)
    belief, _ = of_item(catalogue, known, slot, serial)
    learned = answered(
        catalogue.models,
        catalogue.row_of(serial),
        belief,
        catalogue.signal_of(serial, play.signal),
        moods.class_of(catalogue.models, felt),
    )
    after = _put(entries, serial, slot + 1, learned.belief)
    return replace(after, felt=felt), learned


def has_passed(entries: Entries, slot: int, serial: int) -> bool:
    """Whether an item's belief is of a later slot, in which it was played meanwhile."""
    row = _row(entries, serial)
    return row is not None and int(entries.slot[row]) > slot


def without_forgotten(catalogue: Catalogue, entries: Entries, slot: int) -> Entries:
    """The entries without those forgotten in a slot."""
    old = np.flatnonzero(slot - entries.slot >= REMEMBERED)
    if len(old) == 0:
        return entries
    gone = old[at(catalogue, _rows(entries, old), slot).forgotten]
    return _rows(entries, np.delete(np.arange(len(entries.serial)), gone))


def _replay(
    catalogue: Catalogue, serial: int, log: Sequence[Heard]
) -> tuple[int, Floats]:
    return replayed(
        catalogue.models,
        catalogue.row_of(serial),
        np.array([play.slot for play in log], np.int64),
        np.array([catalogue.signal_of(serial, p.signal) for p in log], np.int64),
        np.array([play.mood for play in log], np.int64),
    )


def _remembered(
    catalogue: Catalogue, serial: int, log: Sequence[Heard]
) -> Sequence[Heard]:
    """The plays since the item was last forgotten: what came before left no trace."""
    start = 0
    for number in range(1, len(log)):
        rested_for = log[number].slot - log[number - 1].slot - 1
        if rested_for >= REMEMBERED:
            slot, belief = _replay(catalogue, serial, log[start:number])
            entries = Entries(
                np.array([serial]), np.array([slot]), belief.reshape(1, -1)
            )
            if at(catalogue, entries, log[number].slot).forgotten.all():
                start = number
    return log[start:]


def _row(entries: Entries, serial: int) -> int | None:
    row = int(np.searchsorted(entries.serial, serial))
    found = row < len(entries.serial) and int(entries.serial[row]) == serial
    return row if found else None


def _rows(entries: Entries, rows: Ints) -> Entries:
    return replace(
        entries,
        serial=entries.serial[rows],
        slot=entries.slot[rows],
        belief=entries.belief[rows],
    )


def _put(entries: Entries, serial: int, slot: int, belief: Floats) -> Entries:
    row = int(np.searchsorted(entries.serial, serial))
    rest = row + 1 if _row(entries, serial) is not None else row
    return Entries(
        np.concatenate((entries.serial[:row], [serial], entries.serial[rest:])),
        np.concatenate((entries.slot[:row], [slot], entries.slot[rest:])),
        np.concatenate((entries.belief[:row], [belief], entries.belief[rest:])),
    )
