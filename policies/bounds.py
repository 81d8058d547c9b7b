"""How much any policy could earn: certified bounds.

The Lagrangian bound L(w) of `relaxation` holds at every price w, and so does T L: what
the best play earns if L comes after it. T L <= L, since V is at least what a play and
what a rest is worth, so J* <= T^D L <= ... <= T L <= L. The price is chosen last, where
T^D L is least; it is convex in w. V comes from value iteration on a grid, which only
errs upwards (Lovejoy 1991).

Of models with moods there is no bound: a mood ties the items together, and L in the
mean mood bounds nothing.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from policies import grid, index, subsidy
from policies.arrays import Floats
from policies.groups import distinct, groups_of
from policies.index import Index
from policies.index_table import MOST_POINTS, divisions_of
from policies.layers import stacked
from policies.lookahead import Ceiling, first_plays
from policies.model_set import ModelSet
from policies.moves import Moves, moves
from policies.situation import Situation
from policies.subsidy import Arm
from policies.tree import SUM_LEAF, now_of, planted, sum_at_rest

PRECISION = 1e-6  # of V, in rewards
NARROW = 1e-4  # the price is found to this share of its range
GOLDEN = (5.0**0.5 - 1) / 2


class Bound(NamedTuple):
    """No policy earns more than `value` on average; found at a price of rest."""

    value: float
    price: float


def worth_for_ever(situation: Situation, discount: float) -> Floats:
    """Return (G,): what playing an item of each group for ever earns.

    The greatest is a lower bound of what the best policy earns.
    """
    worth = subsidy.worth(situation.models, discount)[situation.model]
    earned: Floats = (worth * situation.belief).sum(axis=1)
    return earned


class Effort(NamedTuple):
    """What a bound takes.

    Attributes:
        moves: between points of the grids, which each sweep of value iteration follows.
        leaves: of the look-ahead, at each price.
    """

    moves: int
    leaves: float


def effort(situation: Situation, depth: int, most_points: int = MOST_POINTS) -> Effort:
    """Return what `bound` takes with the same arguments, before it is begun."""
    models, total, plays = situation.models, 0, situation.slate.plays
    for m in np.unique(situation.model).tolist():
        states, signals = int(models.states[m]), int(models.signals[m])
        points = grid.size(states, _divisions(models, m, most_points))
        total += points * states * (signals + 1)
    told = int(models.signals[situation.model].max(initial=1))
    return Effort(total, float(len(situation.model) * told) ** (depth * plays))


def bound(
    situation: Situation,
    discount: float,
    depth: int = 0,
    most_points: int = MOST_POINTS,
) -> Bound:
    """Bound the discounted rewards of any policy from a situation on.

    Args:
        situation: where to start; the hidden states follow its beliefs.
        discount: beta.
        depth: D, in slots; the effort grows with (G K)^(D M) for G groups, K signals
            and M plays in a slot.
        most_points: size of the grids; finer ones give lower bounds.

    Raises:
        ValueError: items of the slot are chosen already; or the models have moods, for
            which nothing is known to be a bound.
    """
    if situation.models.classes > 1:
        raise ValueError("mood: of models with moods there is no bound")
    if len(situation.slate.model) > 0:
        raise ValueError("slate: the slot has begun")
    models, rows = situation.models, np.unique(situation.model).tolist()
    arms = {m: _arm(models, m, discount, most_points) for m in rows}
    values = {m: arm.reward / (1 - discount) for m, arm in arms.items()}
    ranges = [subsidy.range_of(models, m, discount) for m in rows]
    divisions = [_divisions(models, m, most_points) for m in rows]
    steps = moves(models)

    def at(price: float) -> float:
        for m, arm in arms.items():
            advantage = np.empty_like(values[m])
            subsidy.solve(arm, price, values[m], advantage, PRECISION)
        worth = _worth(models, rows, divisions, [values[m] for m in rows])
        return _ahead(steps, situation, worth, depth, price, float(discount))

    return _least(at, min(low for low, _ in ranges), max(high for _, high in ranges))


def _divisions(models: ModelSet, m: int, most_points: int) -> int:
    return divisions_of(int(models.states[m]), most_points)[-1]


def _arm(models: ModelSet, m: int, discount: float, most_points: int) -> Arm:
    return subsidy.arm(models, m, _divisions(models, m, most_points), discount)


def _worth(
    models: ModelSet, rows: list[int], divisions: list[int], values: list[Floats]
) -> Index:
    """Return V of the models that occur, as the worth of an item at a leaf."""
    states = [int(models.states[m]) for m in rows]
    known = index.tabled(stacked(states, divisions, values), models.like.shape[1])
    place = np.zeros((1, len(models.states)), dtype=index.PLACE)
    place[0, rows] = known.place[0]
    worth = np.zeros((1, *models.like.shape))
    leaf = Index(worth, place, known.steps, known.values)
    return index.together([index.linear(models.like), leaf])  # a base plays nothing


def _ahead(
    steps: Moves,
    situation: Situation,
    worth: Index,
    depth: int,
    price: float,
    discount: float,
) -> float:
    """Return T^D L at a price.

    Not compiled, but for its parts, as `exact_rollout` has them: that would compile
    them all once more, into this one.
    """
    alike, _ = distinct(groups_of(situation), False)
    now, items = now_of(situation), int(alike.size.sum())
    plays = min(now.plays, items)
    tried = depth * plays  # in the last slot, too, all items stand at its end
    tree = planted(steps, alike, worth, SUM_LEAF, now, tried, discount)
    paid = price * (items - plays) / (1 - discount)
    tree.constant[0] = sum_at_rest(tree) - paid
    if depth == 0:
        return float(tree.constant[0])
    nothing = np.zeros(len(steps.signals))
    return float(first_plays(tree, tried, Ceiling(nothing, nothing), False).max())


def _least(at: Callable[[float], float], low: float, high: float) -> Bound:
    """Minimise a convex function, by golden section."""
    width = step = high - low
    found = [
        Bound(at(price), price) for price in (high - GOLDEN * step, low + GOLDEN * step)
    ]
    left, right = found
    while step > NARROW * width:
        step *= GOLDEN
        if left.value <= right.value:
            high, right = right.price, left
            price = high - GOLDEN * step
            left = Bound(at(price), price)
        else:
            low, left = left.price, right
            price = low + GOLDEN * step
            right = Bound(at(price), price)
    return min(left, right)
