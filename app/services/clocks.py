"""The clock that slots follow: set, stopped, and read for a user."""

from datetime import UTC, datetime, timedelta

from app.domain import Anchor, Clock, User
from app.storage import audit, revision, users
from app.storage.store import Store

SHORTEST, LONGEST = 1.0, 86_400.0  # seconds of a slot
MOST_SLOT = 2**30  # to which a clock leads; beyond, slots are counted by plays
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
MILLISECOND = timedelta(milliseconds=1)


def current(store: Store) -> Clock:
    return revision.current(store).clock


def put(store: Store, slot_s: float, by: str) -> Clock:
    """Let slots follow a clock from now on, each so many seconds long."""
    known = current(store)
    return known if known.slot_s == slot_s else _change(store, known, slot_s, by)


def stop(store: Store, by: str) -> None:
    """Count slots by plays alone from now on."""
    known = current(store)
    if known.slot_s is not None:
        _change(store, known, None, by)


def anchored(store: Store, user: User, slot: int, at: datetime, clock: Clock) -> Anchor:
    """Tie a user to a clock in a slot: in that, a user known was last seen.

    at: when one begins who is new
    """
    seen = users.last_seen(store, user.id) if user.version else None
    return tied(slot, seen or at, clock)


def tied(slot: int, at: datetime, clock: Clock) -> Anchor:
    """Let a slot begin at a moment."""
    return Anchor(clock.version, _moment(at) - slot * _length(clock))


def slot_at(clock: Clock, anchor: Anchor, at: datetime) -> int:
    """The slot that a clock shows; below zero, before the first began."""
    return min((_moment(at) - anchor.began) // _length(clock), MOST_SLOT)


def _change(store: Store, known: Clock, slot_s: float | None, by: str) -> Clock:
    clock = revision.advance_clock(store, known, slot_s)
    detail = {"slot_s": slot_s}
    audit.note(store, datetime.now(UTC), by, "clock", str(clock.version), detail)
    return clock


def _moment(at: datetime) -> int:
    return (at - EPOCH) // MILLISECOND


def _length(clock: Clock) -> int:
    if clock.slot_s is None:
        raise ValueError("the clock stands still")
    return round(clock.slot_s * 1000)
