"""What a policy could choose from, in groups, as in the service."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from learning.off_policy.beliefs import Beliefs
from learning.off_policy.catalogue import Catalogue
from policies import ALONE, NEVER, Ints, Situation, Slate


class Candidates(NamedTuple):
    """A situation, and which arms its groups stand for.

    Attributes:
        situation: G groups: played arms alone, then by model those that are like arms
            never played.
        arm: (T,) of the first T groups, ascending.
    """

    situation: Situation
    arm: Ints

    def group(self, arm: int, model: int) -> int:
        """Return the group of a candidate of some model."""
        alone = len(self.arm)
        row = int(np.searchsorted(self.arm, arm))
        if row < alone and int(self.arm[row]) == arm:
            return row
        return alone + int(np.searchsorted(self.situation.model[alone:], model))


def candidates(
    catalogue: Catalogue,
    beliefs: Beliefs,
    before: Sequence[int],
    plays: int,
    *,
    rest_matters: bool,
) -> Candidates:
    """Group the arms that are offered.

    Args:
        catalogue: of arms.
        beliefs: of the user.
        before: arms that are chosen for this slot already.
        plays: that the slot holds.
        rest_matters: to the policy that is to choose.
    """
    chosen = np.array(before, dtype=np.int64)
    like_untouched = beliefs.forgotten if rest_matters else beliefs.returned
    free = catalogue.offered[beliefs.arm] & ~np.isin(beliefs.arm, chosen)
    own = free & ~like_untouched
    arm = beliefs.arm[own]
    model = catalogue.model[arm]
    count = catalogue.count.copy()
    np.subtract.at(count, model, 1)
    np.subtract.at(count, catalogue.model[chosen[catalogue.offered[chosen]]], 1)
    groups = np.flatnonzero(count)
    situation = Situation(
        catalogue.models,
        np.concatenate((model, groups)),
        np.concatenate((beliefs.belief[own], beliefs.fresh[groups])),
        np.concatenate((np.ones(len(arm), dtype=np.int64), count[groups])),
        np.concatenate((beliefs.rested[own], np.full(len(groups), NEVER))),
        _slate(catalogue, beliefs, chosen, plays),
        beliefs.mood,
        beliefs.resumed,
    )
    return Candidates(situation, arm)


def _slate(catalogue: Catalogue, beliefs: Beliefs, chosen: Ints, plays: int) -> Slate:
    if plays == 1:
        return ALONE
    model = catalogue.model[chosen]
    belief = np.empty((len(chosen), beliefs.fresh.shape[1]))
    for row, (arm, kind) in enumerate(zip(chosen, model, strict=True)):
        belief[row] = beliefs.of(int(arm), int(kind))
    return Slate(plays, model, belief)
