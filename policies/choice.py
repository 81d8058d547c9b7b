"""From scores to the item that is played."""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints, as_floats, as_ints
from policies.compiled import compiled
from policies.randomness import TIES, uniform


class Choice(NamedTuple):
    """The item to play.

    Attributes:
        group: its row in the situation.
        member: which of the group's items, 0 <= member < count[group].
        propensity: the probability with which this very item was chosen.
    """

    group: int
    member: int
    propensity: float


def choose(scores: Floats, count: Ints, seed: int) -> Choice:
    """Choose an item of the highest score, uniformly among the items that tie exactly.

    Args:
        scores: (G,).
        count: (G,) items of each group; a group weighs by its items.
        seed: of this decision, 0 <= seed < 2**63.

    Raises:
        ValueError: there is no group, or a score is not finite.
    """
    if len(scores) == 0:
        raise ValueError("scores: nothing to choose from")
    group, member, tied = _choose(as_floats(scores), as_ints(count), seed)
    if tied == 0:
        raise ValueError(f"scores[{group}]: {scores[group]} is not finite")
    return Choice(group, member, 1 / tied)


@compiled
def _choose(scores: Floats, count: Ints, seed: int) -> tuple[int, int, int]:
    """Return group, member and number of items tied; none tied: that score is bad."""
    best, tied = 0, 0
    for g in range(len(scores)):
        if not np.isfinite(scores[g]):
            return g, 0, 0
        if scores[g] > scores[best]:
            best, tied = g, 0
        if scores[g] == scores[best]:
            tied += count[g]
    ordinal = int(uniform(seed, TIES, 0, 0) * tied)
    group = best
    while ordinal >= count[group]:
        ordinal -= count[group]
        group += 1
        while scores[group] != scores[best]:
            group += 1
    return group, ordinal, tied
