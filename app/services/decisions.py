"""From what is believed of a user to the item to play."""

from dataclasses import dataclass

import numpy as np

from app.services.beliefs import Beliefs
from app.services.catalogue import Catalogue
from app.services.moods import state_of
from app.services.pool import Pool
from app.storage.packing import Felt
from policies import (
    NEUTRAL,
    NEVER,
    Choice,
    Floats,
    Ints,
    Mixture,
    Policy,
    Scorer,
    Situation,
    choose,
    expected_like,
)


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """A situation, and which items its groups stand for.

    The first groups are played items, one each; the rest hold, by model, the items
    about which nothing is known that is not known of all of them.

    catalogue: in which the items are
    situation: G groups
    left:      (G,) items of each group that may be chosen
    serial:    (T,) items of the first T groups, ascending
    taken:     items that none of the other groups holds any more, ascending
    pool:      what the choice is made from
    """

    catalogue: Catalogue
    situation: Situation
    left: Ints
    serial: Ints
    taken: Ints
    pool: Pool

    def item(self, choice: Choice) -> int:
        """Serial of the item chosen."""
        if choice.group < len(self.serial):
            return int(self.serial[choice.group])
        model = int(self.situation.model[choice.group])
        return self.pool.member(model, choice.member, taken=self.taken)

    def groups(self, serials: Ints) -> Ints:
        """The group of each of these items."""
        alone = len(self.serial)
        model = self.catalogue.model[serials]
        return np.where(
            np.isin(serials, self.serial),
            np.searchsorted(self.serial, serials),
            alone + np.searchsorted(self.situation.model[alone:], model),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """What was chosen, from what, and why."""

    candidates: Candidates
    scores: Floats
    choice: Choice
    serial: int
    predicted: float
    seed: int


def candidates(
    catalogue: Catalogue,
    pool: Pool,
    beliefs: Beliefs,
    policy: Policy,
    felt: Felt | None = None,
) -> Candidates:
    """Group the pool: played items alone, all others with their model's untouched."""
    like_untouched = beliefs.forgotten if policy.rest_matters else beliefs.returned
    own = pool.holds(beliefs.serial) & ~like_untouched
    serial = beliefs.serial[own]
    model = catalogue.model[serial]
    count = np.array([len(held) for held in pool.by_model], np.int64)
    np.subtract.at(count, model, 1)
    np.subtract.at(count, catalogue.model[pool.excluded], 1)
    groups = np.flatnonzero(count > 0)
    situation = Situation(
        catalogue.models,
        np.concatenate((model, groups)),
        np.concatenate((beliefs.belief[own], beliefs.fresh[groups])),
        np.concatenate((np.ones(len(serial), np.int64), count[groups])),
        np.concatenate((beliefs.rested[own], np.full(len(groups), NEVER, np.int64))),
        mood=NEUTRAL if felt is None else state_of(felt),
        resumed=felt is not None and felt.resumed,
    )
    return Candidates(catalogue, situation, situation.count, serial, serial, pool)


def decide(
    candidates: Candidates, scorer: Scorer, seed: int, place: int = 0
) -> Decision:
    """Score every group, play the best; `place`: how many were chosen before it."""
    situation = candidates.situation
    scored = scorer(situation, seed)
    choice = choose(scored, candidates.left, seed, place)
    scores = scored.scores[choice.row] if isinstance(scored, Mixture) else scored
    group = slice(choice.group, choice.group + 1)
    like = expected_like(
        situation.models,
        situation.model[group],
        situation.belief[group],
        situation.mood_class,
    )
    return Decision(
        candidates, scores, choice, candidates.item(choice), float(like[0]), seed
    )
