"""When an item is back: the expected reward over the coming slots of rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from app.errors import ItemNotFound
from app.services import beliefs, moods
from app.services.catalogue import Catalogue
from app.services.live import Live
from app.services.moods import Mood
from app.services.standing import Standing
from app.storage import users
from app.storage.store import Store
from policies import forecast, untouched

RETURNED = 0.95  # share of the reward that rest leads to


@dataclass(frozen=True, slots=True)
class Forecast:
    """The expected reward of one item, if it rests: with skip and like, its chance.

    slot:      the user's slot now
    rested:    slots since it was played, None if never
    now:       expected reward now
    likes:     the same after 1, 2, ... further slots of rest
    threshold: reward at which it counts as back
    back_in:   slots of rest until then; 0: it is back; None: not within the forecast
    mood:      of the user now, which is taken to last
    slot_s:    seconds of a slot, where slots follow a clock
    """

    slot: int
    rested: int | None
    now: float
    likes: Sequence[float]
    threshold: float
    back_in: int | None
    mood: Mood | None
    slot_s: float | None


def of_item(
    store: Store,
    live: Live,
    user_id: str,
    item: str,
    slots: int,
    threshold: float | None,
) -> Forecast:
    """The forecast of an item for a user, also of one never played."""
    revision, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, revision)
    serial = catalogue.serial_of(item)
    if serial is None:
        raise ItemNotFound(item)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    standing.keep_time(revision.clock)
    belief, rested = beliefs.of_item(catalogue, standing.entries, standing.slot, serial)
    felt = standing.felt()
    mood = moods.class_of(catalogue.models, felt)
    now = beliefs.expected(catalogue, serial, belief, mood)
    likes = forecast(catalogue.models, catalogue.row_of(serial), belief, slots, mood)
    wanted = _returned(catalogue, serial, mood) if threshold is None else threshold
    back = np.flatnonzero(np.concatenate(([now], likes)) >= wanted)
    return Forecast(
        slot=standing.slot,
        rested=rested,
        now=now,
        likes=likes.tolist(),
        threshold=wanted,
        back_in=int(back[0]) if len(back) else None,
        mood=moods.described(catalogue.models, felt),
        slot_s=revision.clock.slot_s,
    )


def _returned(catalogue: Catalogue, serial: int, mood: int) -> float:
    """Nearly the expected reward that a very long rest leads to."""
    row = catalogue.row_of(serial)
    settled = untouched(catalogue.models, 2**20)[row]
    return RETURNED * beliefs.expected(catalogue, serial, settled, mood)
