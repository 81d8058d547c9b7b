"""From scores to the item that is played."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints, as_floats, as_ints
from policies.compiled import compiled
from policies.randomness import MIXTURE, TIES, uniform


class Mixture(NamedTuple):
    """Scores of a policy that chooses at random: it acts by one row of R, drawn.

    Attributes:
        weight: (R,) chance of each row, of sum one.
        scores: (R, G).
    """

    weight: Floats
    scores: Floats


def mixed(weight: Sequence[float], parts: Sequence[Floats | Mixture]) -> Mixture:
    """Return the scores of a policy that acts by one of several, drawn by weight.

    Args:
        weight: chance of each part, of sum one.
        parts: scores of the same G groups, or mixtures of them.
    """
    rows = [p if isinstance(p, Mixture) else Mixture(ALONE, p[None]) for p in parts]
    return Mixture(
        np.concatenate([w * row.weight for w, row in zip(weight, rows, strict=True)]),
        np.concatenate([row.scores for row in rows]),
    )


class Choice(NamedTuple):
    """The item to play.

    Attributes:
        group: its row in the situation.
        member: which of the group's items, 0 <= member < count[group].
        propensity: the probability with which this very item was chosen.
        row: the row of the mixture that was drawn, 0 if there is no mixture.
    """

    group: int
    member: int
    propensity: float
    row: int = 0


def choose(scored: Floats | Mixture, count: Ints, seed: int, place: int = 0) -> Choice:
    """Choose an item of the highest score, uniformly among the items that tie exactly.

    Of a mixture, one row decides; the propensity is over all rows.

    Args:
        scored: (G,) scores, or a mixture of them.
        count: (G,) items of each group; a group weighs by its items. A group without
            items is never chosen.
        seed: of this decision, 0 <= seed < 2**63.
        place: number of the choice where several are made under one seed.

    Raises:
        ValueError: there is no item, or a score is not finite.
    """
    weight, scores = scored if isinstance(scored, Mixture) else (ALONE, scored[None])
    group, member, propensity, row = pick(
        as_floats(weight), as_floats(scores), as_ints(count), seed, place
    )
    if group < 0:
        raise ValueError("scores: nothing to choose from")
    if propensity == 0.0:
        raise ValueError(f"scores[{group}]: {scores[row, group]} is not finite")
    return Choice(group, member, propensity, row)


ALONE = np.ones(1)


def chances(scored: Floats | Mixture, count: Ints) -> Floats:
    """Return (G,): the probability with which `choose` would choose each item.

    The items of a group share it; over all items it sums to one.

    Args:
        scored: (G,) scores, or a mixture of them.
        count: (G,) items of each group.

    Raises:
        ValueError: there is no item, or a score is not finite.
    """
    weight, scores = scored if isinstance(scored, Mixture) else (ALONE, scored[None])
    if not (count > 0).any():
        raise ValueError("scores: nothing to choose from")
    if not np.isfinite(scores).all():
        raise ValueError("scores: one is not finite")
    return _chances(as_floats(weight), as_floats(scores), as_ints(count))


@compiled
def _chances(weight: Floats, scores: Floats, count: Ints) -> Floats:
    found = np.zeros(len(count))
    for r in range(len(weight)):
        highest, items = _best(scores, r, count)
        for g in range(len(count)):
            if count[g] > 0 and scores[r, g] == highest:
                found[g] += weight[r] / items
    return found


@compiled
def pick(
    weight: Floats, scores: Floats, count: Ints, seed: int, place: int
) -> tuple[int, int, float, int]:
    """Return group, member, propensity and row.

    Group -1: there is no item. Propensity 0: that score is bad.
    """
    for r in range(len(weight)):
        for g in range(len(count)):
            if not np.isfinite(scores[r, g]):
                return g, 0, 0.0, r
    row = _drawn(weight, seed, place)
    best, tied = _best(scores, row, count)
    if tied == 0:
        return -1, 0, 0.0, row
    ordinal = int(uniform(seed, TIES, place, 0) * tied)
    group = -1
    while ordinal >= 0:
        group += 1
        if scores[row, group] == best:
            ordinal -= count[group]
    propensity = 0.0
    for r in range(len(weight)):
        highest, items = _best(scores, r, count)
        if scores[r, group] == highest:
            propensity += weight[r] / items
    return group, ordinal + count[group], propensity, row


@compiled
def _drawn(weight: Floats, seed: int, place: int) -> int:
    """Draw a row by its weight."""
    left = uniform(seed, MIXTURE, place, 0) if len(weight) > 1 else 0.0
    for r in range(len(weight) - 1):
        left -= weight[r]
        if left < 0.0:
            return r
    return len(weight) - 1


@compiled
def _best(scores: Floats, row: int, count: Ints) -> tuple[float, int]:
    """Return the highest score of a row, and how many items have it."""
    best, items = -np.inf, 0
    for g in range(len(count)):
        if count[g] > 0 and scores[row, g] > best:
            best, items = scores[row, g], 0
        if scores[row, g] == best:
            items += count[g]
    return best, items
