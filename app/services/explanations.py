"""Why an item was chosen: what was believed of each candidate, and its score."""

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

import numpy as np

from app.domain import Play, PolicyVersion, Source
from app.errors import PlayNotFound
from app.services.catalogue import Shelf
from app.services.live import Live
from app.services.replays import Replay, is_known, replay
from app.storage import plays, revision
from app.storage.store import Store
from policies import NEVER, Choice, expected_like

MOST_GROUPS = 100


@dataclass(frozen=True, slots=True)
class Group:
    """Candidates of which the same is believed.

    item:   the one item, None if the group holds several
    count:  how many items it holds
    belief: probability of each state
    like:   expected reward
    score:  the policy's number; the highest is played
    rested: slots since it was played, None if never
    """

    item: str | None
    model: str
    count: int
    states: Sequence[str]
    belief: Sequence[float]
    like: float
    score: float
    rested: int | None


@dataclass(frozen=True, slots=True)
class Explanation:
    """The groups of highest score, the one that was played first.

    groups:     how many there were in all
    candidates: the best of them
    runner_up:  the best group that was not played
    """

    groups: int
    candidates: Sequence[Group]
    runner_up: Group | None


@dataclass(frozen=True, slots=True)
class Record:
    """A play as it is kept, and who chose it why."""

    play: Play
    shelf: Shelf
    policy: PolicyVersion | None
    explanation: Explanation | None


def record(store: Store, live: Live, play_id: UUID, *, explain: bool) -> Record:
    """A play, and if asked why it was chosen.

    Of reported plays nobody can tell, nor where plays before them were dropped.
    """
    play = plays.by_id(store, play_id)
    if play is None:
        raise PlayNotFound(play_id)
    shelf = live.catalogue(store, revision.current(store)).shelf(play.item)
    if play.policy is None or play.source is not Source.RECOMMENDED:
        return Record(play, shelf, None, None)
    explanation = None
    if explain and is_known(store, play):
        explanation = explained(replay(store, live, play))
    return Record(play, shelf, live.version(store, play.policy), explanation)


def explained(replay: Replay) -> Explanation:
    """The candidates of a decision, best first."""
    decision = replay.decision
    left = decision.candidates.left > 0
    order = np.argsort(-decision.scores, kind="stable")
    order = order[left[order] & (order != decision.choice.group)][: MOST_GROUPS - 1]
    others = [_group(replay, int(row)) for row in order]
    played = _group(replay, decision.choice.group)
    return Explanation(
        groups=int(left.sum()),
        candidates=(played, *others),
        runner_up=others[0] if others else None,
    )


def _group(replay: Replay, row: int) -> Group:
    situation = replay.decision.candidates.situation
    only, m = slice(row, row + 1), int(situation.model[row])
    model = replay.catalogue.versions[m]
    like = expected_like(
        situation.models,
        situation.model[only],
        situation.belief[only],
        situation.mood_class,
    )
    rested = int(situation.rested[row])
    count = int(replay.decision.candidates.left[row])
    return Group(
        item=_only_item(replay, row) if count == 1 else None,
        model=model.id,
        count=count,
        states=model.states,
        belief=situation.models.by_state(m, situation.belief[row]).tolist(),
        like=float(like[0]),
        score=float(replay.decision.scores[row]),
        rested=None if rested == NEVER else rested,
    )


def _only_item(replay: Replay, row: int) -> str:
    serial = replay.decision.candidates.item(Choice(row, 0, 1.0))
    return replay.catalogue.shelf(serial).id
