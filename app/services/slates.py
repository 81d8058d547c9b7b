"""Several plays for one slot, chosen one after the other.

Each is chosen as if those before it were certain. The score of an index does not depend
on them, so it is computed once, and the best items by that index are played together.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.services import decisions
from app.services.decisions import Candidates, Decision
from app.services.rungs import Rung
from policies import Floats, Ints, Mixture, Scorer, Situation, Slate


def decide(
    candidates: Candidates, rung: Rung, seed: int, count: int
) -> Sequence[Decision]:
    """Choose items for the places of one slot; there must be as many."""
    if count > 1 and rung.policy.is_index:
        rung = replace(rung, scorer=_once(rung.scorer))
    made: list[Decision] = []
    while len(made) < count:
        before = [decision.serial for decision in made]
        made.append(decide_next(candidates, rung, seed, before, count))
    return made


def decide_next(
    candidates: Candidates,
    rung: Rung,
    seed: int,
    before: Sequence[int],
    count: int,
) -> Decision:
    """Choose one of `count` items for one slot; those before it are chosen."""
    if count > 1:
        chosen = np.array(before, np.int64)
        if rung.policy.is_index:
            candidates = _fewer(candidates, chosen)
        else:
            candidates = _beside(candidates, chosen, count)
    return decisions.decide(candidates, rung.scorer, seed, len(before))


def _fewer(candidates: Candidates, chosen: Ints) -> Candidates:
    """The same situation, in which items that are chosen cannot be chosen again."""
    left = candidates.left.copy()
    np.subtract.at(left, candidates.groups(chosen), 1)
    return replace(candidates, left=left, taken=np.union1d(candidates.taken, chosen))


def _beside(candidates: Candidates, chosen: Ints, count: int) -> Candidates:
    """A situation of the other items, that tells which are chosen."""
    whole = candidates.situation
    groups = candidates.groups(chosen)
    fewer = _fewer(candidates, chosen)
    held = fewer.left > 0
    situation = Situation(
        whole.models,
        whole.model[held],
        whole.belief[held],
        fewer.left[held],
        whole.rested[held],
        Slate(count, whole.model[groups], whole.belief[groups]),
        whole.mood,
        whole.resumed,
    )
    return replace(
        fewer,
        situation=situation,
        left=situation.count,
        serial=candidates.serial[held[: len(candidates.serial)]],
    )


def _once(scorer: Scorer) -> Scorer:
    """The scores of the first time, whenever they are asked for again."""
    first: list[Floats | Mixture] = []

    def scores(situation: Situation, seed: int) -> Floats | Mixture:
        if not first:
            first.append(scorer(situation, seed))
        return first[0]

    return scores
