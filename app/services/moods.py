"""The mood of a user: what it follows from is kept, and found again in the log.

The plays of a slot are all in the mood in which it begins, in whatever order they are
answered. So what is kept is the mood with which the last slot began, and its answers.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise

import numpy as np

from app.domain import LIKE, SKIP
from app.services.catalogue import Catalogue
from app.storage.packing import Felt
from app.storage.plays import ClosedPlay
from policies import NEUTRAL, NONE, Ints, ModelSet, MoodState

BEGINNING = datetime(1970, 1, 1, tzinfo=UTC)
MICROSECOND = timedelta(microseconds=1)
UNFELT = Felt(-1, 0, *NEUTRAL, resumed=False)


@dataclass(frozen=True, slots=True)
class Mood:
    """The mood of a user's next play, for people.

    number:   its class
    last:     the last answers, as many as are told apart, the latest last
    tendency: share of likes, the later ones counting more
    paused:   whether the play comes after a pause
    """

    number: int
    last: Sequence[str]
    tendency: float
    paused: bool


def unfelt(catalogue: Catalogue) -> Felt | None:
    """What is kept about a user of whom nothing is known; nothing without moods."""
    return UNFELT if catalogue.models.classes > 1 else None


def begun(
    catalogue: Catalogue, felt: Felt | None, slot: int, at: datetime
) -> Felt | None:
    """What is felt in a slot, which begins at a moment if it has not begun."""
    if felt is None or slot <= felt.slot:
        return felt
    models, began = catalogue.models, _micros(at)
    waited = None if felt.slot < 0 else (began - felt.began) / 1e6
    return Felt(slot, began, *_after(models, felt), resumed=models.resumed(waited))


def class_of(models: ModelSet, felt: Felt | None) -> int:
    """The class of the mood in a slot."""
    return 0 if felt is None else models.mood_class(state_of(felt), felt.resumed)


def state_of(felt: Felt) -> MoodState:
    """What the mood of a slot follows from."""
    return MoodState(felt.recent, felt.told, felt.tendency)


def described(models: ModelSet, felt: Felt | None) -> Mood | None:
    """The mood of a slot, for people."""
    if felt is None:
        return None
    last = [LIKE if digit == "1" else SKIP for digit in f"{felt.recent:b}"[1:]]
    return Mood(class_of(models, felt), last, felt.tendency, felt.resumed)


def rebuilt(catalogue: Catalogue, log: Sequence[ClosedPlay]) -> tuple[Ints, Felt]:
    """The class of the mood in each play of a user's log, and what is felt after it."""
    if not log:
        return np.empty(0, np.int64), UNFELT
    liked = np.array([_liked(catalogue, play) for play in log], np.int64)
    slots = np.array([play.slot for play in log], np.int64)
    began = np.array([_micros(play.created_at) for play in log], np.int64)
    first = np.flatnonzero(np.diff(slots, prepend=-1))
    resumed = np.zeros(len(log), np.bool_)
    for before, now in pairwise(first.tolist()):
        resumed[now] = catalogue.models.resumed((began[now] - began[before]) / 1e6)
    classes, state = catalogue.models.mood_course(liked, slots, resumed)
    last = int(first[-1])
    felt = Felt(int(slots[last]), int(began[last]), *state, resumed=bool(resumed[last]))
    for play, answer in zip(log[last:], liked[last:].tolist(), strict=True):
        felt = _answered(felt, play.place, answer)
    return classes, felt


def after(catalogue: Catalogue, felt: Felt | None, play: ClosedPlay) -> Felt | None:
    """What is felt after a play that does not come late."""
    now = begun(catalogue, felt, play.slot, play.created_at)
    if now is None or play.slot < now.slot:
        return now
    return _answered(now, play.place, _liked(catalogue, play))


def comes_late(catalogue: Catalogue, felt: Felt | None, play: ClosedPlay) -> bool:
    """Whether an answer changes the mood of plays that have been answered since."""
    if felt is None or play.slot >= felt.slot:
        return False
    return _liked(catalogue, play) != NONE


def _answered(felt: Felt, place: int, liked: int) -> Felt:
    if liked == NONE:
        return felt
    return replace(felt, answers=tuple(sorted((*felt.answers, (place, liked)))))


def _after(models: ModelSet, felt: Felt) -> MoodState:
    state = state_of(felt)
    for _, liked in felt.answers:
        state = models.mood_after(state, liked)
    return state


def _liked(catalogue: Catalogue, play: ClosedPlay) -> int:
    signal = catalogue.signal_of(play.item, play.signal)
    return catalogue.models.liked(catalogue.row_of(play.item), signal)


def _micros(at: datetime) -> int:
    return (at - BEGINNING) // MICROSECOND
