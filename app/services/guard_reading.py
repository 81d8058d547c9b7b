"""What the log of plays tells the guard: predictions, and what was answered."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import NamedTuple
from uuid import UUID

from app.domain import ItemModel
from app.services.guard_scores import Outcome, number_of
from app.storage import judgements
from app.storage.judgements import PlayRow
from app.storage.store import Store

PAGE = 250  # plays that are read at once, between which requests have their turn
MOST = 5_000  # plays of one check


class Told(NamedTuple):
    """A play that was predicted and answered, and the policy that chose it."""

    policy: int
    outcome: Outcome


@dataclass(slots=True)
class Reading:
    """Plays of present versions of models, by model, in order.

    after: the last play that was read
    more:  whether there may be others
    """

    after: UUID
    told: dict[str, list[Told]] = field(default_factory=dict)
    more: bool = False


def read(
    store: Store, after: UUID, models: Sequence[ItemModel], settled: datetime
) -> Reading:
    """Read on after a play, up to one that still waits for its answer.

    Likes may come later than skips: to take answers as they come in would be unfair.

    settled: plays chosen before are not waited for
    """
    rewards = {(model.id, model.version): model.rewards for model in models}
    reading = Reading(after)
    for _ in range(MOST // PAGE):
        page = judgements.plays_after(store, reading.after, PAGE)
        for play in page:
            if play.closed is None and play.created_at >= settled:
                return reading
            reading.after = play.id
            _take(reading, play, rewards.get((play.model, play.version), {}))
        if len(page) < PAGE:
            return reading
        store.pause()
    reading.more = True
    return reading


def _take(reading: Reading, play: PlayRow, rewards: Mapping[str, float]) -> None:
    """Count a play, if it was recommended, and answered with what its model knows."""
    reward = rewards.get(play.signal or "")
    if play.policy is None or reward is None:
        return
    outcome = (number_of(play.user), play.item, play.predicted, reward)
    reading.told.setdefault(play.model, []).append(Told(play.policy, outcome))
