"""The Lagrangian relaxation: items for themselves, held together by a price.

If each slot could play any number of items, as long as as many as before are played on
average, the items would part: with a price (a subsidy for rest) w,

    L(w) = sum_n V_w(pi_n) - w (N - M) / (1 - beta) >= J*

for N items of which M are played in a slot (Whittle 1988; Adelman and Mersereau 2008).
L is convex in w. The values V of the index tables are upper bounds, so that L is one.
"""

from typing import NamedTuple

import numpy as np

from policies import grid, subsidy
from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner
from policies.index import LINEAR, PLACE, Index
from policies.layers import Layers, stacked
from policies.model_set import ModelSet
from policies.situation import Situation
from policies.tables import Tables

NARROW = 1e-7  # the price is found to this share of its range
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


class Relaxation(NamedTuple):
    """M models at one discount, at any price.

    Attributes:
        low: (M,) up to this price, playing is always best.
        high: (M,) from this price, resting is.
        like: (M, S).
        worth: (M, S) playing for ever, by state.
        gain: (M, S) advantage of playing once and then for ever, at no price.
        value: L layers, V at prices spread evenly from `low` to `high`.
        advantage: L layers, of playing over resting, at the same prices.
        rungs: L.
        discount: beta.
    """

    low: Floats
    high: Floats
    like: Floats
    worth: Floats
    gain: Floats
    value: Layers
    advantage: Layers
    rungs: int
    discount: float


class Priced(NamedTuple):
    """The price at which the bound L is least, and that bound."""

    price: float
    bound: float


def relaxed(models: ModelSet, tables: Tables) -> Relaxation:
    """Prepare the relaxation of the models that have tables."""
    beta = tables.discount
    worth = subsidy.worth(models, beta)
    moves = models.play - models.rest
    gain = models.like + beta * (moves @ worth[..., None])[..., 0]
    value = tables.value
    rows = range(len(tables.low))
    rungs = len(value.values) // int(value.size.sum()) if rows else 0
    advantages = [_advantages(models, tables, m, rungs) for m in rows]
    states, divisions = value.states.tolist(), value.divisions.tolist()
    advantage = stacked(states, divisions, advantages)
    return Relaxation(
        tables.low,
        tables.high,
        models.like,
        worth,
        gain,
        value,
        advantage,
        rungs,
        beta,
    )


def _advantages(models: ModelSet, tables: Tables, m: int, rungs: int) -> Floats:
    value = tables.value
    start, size = int(value.start[m]), int(value.size[m])
    kept = value.values[start : start + rungs * size].reshape(rungs, size)
    arm = subsidy.arm(models, m, int(value.divisions[m]), tables.discount)
    prices = np.linspace(tables.low[m], tables.high[m], rungs)
    return subsidy.advantages(arm, prices, kept)


@compiled
def priced_value(relaxation: Relaxation, price: float) -> Index:
    """Return V at a price."""
    index = _empty(relaxation, relaxation.value)
    price_values(relaxation, price, index, 0)
    return index


@compiled
def priced_advantage(relaxation: Relaxation, price: float) -> Index:
    """Return the advantage of playing over resting, at a price."""
    index = _empty(relaxation, relaxation.advantage)
    price_advantages(relaxation, price, index, 0)
    return index


@compiled
def price_values(relaxation: Relaxation, price: float, index: Index, b: int) -> None:
    """Put V at a price in the place of function b, which has its layers."""
    for m in range(len(relaxation.low)):
        if price <= relaxation.low[m]:
            index.worth[b, m] = relaxation.worth[m]
            index.place[b, m].layer = LINEAR
        elif price >= relaxation.high[m]:
            index.worth[b, m] = price / (1 - relaxation.discount)
            index.place[b, m].layer = LINEAR
        else:
            _blend(relaxation, index, b, m, price)


@compiled
def price_advantages(
    relaxation: Relaxation, price: float, index: Index, b: int
) -> None:
    """Put the advantage at a price in the place of function b, which has its layers."""
    for m in range(len(relaxation.low)):
        if price <= relaxation.low[m]:
            index.worth[b, m] = relaxation.gain[m] - price
            index.place[b, m].layer = LINEAR
        elif price >= relaxation.high[m]:
            index.worth[b, m] = relaxation.like[m] - price
            index.place[b, m].layer = LINEAR
        else:
            _blend(relaxation, index, b, m, price)


def least_of(relaxation: Relaxation, situation: Situation) -> Priced:
    """Minimise L over the price, for all items: those chosen already, too."""
    slate = situation.slate
    model, belief, count = situation.model, situation.belief, situation.count
    if len(slate.model) > 0:
        model = np.concatenate((model, slate.model))
        belief = np.concatenate((belief, slate.belief))
        count = np.concatenate((count, np.ones(len(slate.model), np.int64)))
    priced: Priced = least(relaxation, model, belief, count, slate.plays)
    return priced


@compiled
def least(
    relaxation: Relaxation, model: Ints, belief: Floats, count: Ints, plays: int
) -> Priced:
    """Minimise L over the price, by golden section.

    Args:
        relaxation: of M models.
        model: (G,) row of each group's model.
        belief: (G, S).
        count: (G,) items.
        plays: items played in a slot, M; of more than there are, all are played.
    """
    plays = min(plays, count.sum())
    low, high = np.inf, -np.inf
    for g in range(len(model)):
        low = min(low, relaxation.low[model[g]])
        high = max(high, relaxation.high[model[g]])
    located = _located(relaxation, model, belief)
    width = max(high - low, 0.0)
    step = GOLDEN * width
    left, right = high - step, low + step
    at_left = _bound(relaxation, located, model, belief, count, plays, left)
    at_right = _bound(relaxation, located, model, belief, count, plays, right)
    while step > NARROW * width:
        step *= GOLDEN
        if at_left <= at_right:
            high, right, at_right = right, left, at_left
            left = high - step
            at_left = _bound(relaxation, located, model, belief, count, plays, left)
        else:
            low, left, at_left = left, right, at_right
            right = low + step
            at_right = _bound(relaxation, located, model, belief, count, plays, right)
    if at_left <= at_right:
        return Priced(left, at_left)
    return Priced(right, at_right)


@compiled
def _empty(relaxation: Relaxation, layers: Layers) -> Index:
    models, states = relaxation.like.shape
    place = np.zeros((1, models), dtype=PLACE)
    for m in range(len(layers.states)):
        place[0, m].start = layers.start[m]
        place[0, m].size = layers.size[m]
        place[0, m].divisions = layers.divisions[m]
        place[0, m].states = layers.states[m]
    return Index(np.zeros((1, models, states)), place, layers.steps, layers.values)


@inner
def _rung(relaxation: Relaxation, m: int, price: float) -> tuple[int, float]:
    """Return the rung below a price that lies inside model m's range, and what is left.

    V is convex in the price, so that a line between two rungs lies above it.
    """
    low, high = relaxation.low[m], relaxation.high[m]
    place = (price - low) / (high - low) * (relaxation.rungs - 1)
    rung = min(int(place), relaxation.rungs - 2)
    return rung, place - rung


@inner
def _blend(relaxation: Relaxation, index: Index, b: int, m: int, price: float) -> None:
    rung, blend = _rung(relaxation, m, price)
    index.place[b, m].layer = rung
    index.place[b, m].blend = blend


@compiled
def _located(
    relaxation: Relaxation, model: Ints, belief: Floats
) -> tuple[Ints, Floats]:
    """Return (G, S): the corners around each belief, and their weights."""
    value = relaxation.value
    ranks = np.zeros(belief.shape, dtype=np.int64)
    weights = np.zeros(belief.shape)
    corners = grid.corners(belief.shape[1])
    for g in range(len(model)):
        m = model[g]
        grid.locate(
            value.steps, value.states[m], value.divisions[m], belief, g, corners
        )
        for j in range(value.states[m]):
            ranks[g, j] = corners[j].rank
            weights[g, j] = corners[j].weight
    return ranks, weights


@compiled
def _bound(
    relaxation: Relaxation,
    located: tuple[Ints, Floats],
    model: Ints,
    belief: Floats,
    count: Ints,
    plays: int,
    price: float,
) -> float:
    """Return L at a price."""
    items, total = 0, 0.0
    for g in range(len(model)):
        items += count[g]
        total += count[g] * _value(relaxation, located, model[g], belief, g, price)
    return total - price * (items - plays) / (1 - relaxation.discount)


@inner
def _value(
    relaxation: Relaxation,
    located: tuple[Ints, Floats],
    m: int,
    belief: Floats,
    g: int,
    price: float,
) -> float:
    """Return V of group g, of model m, at a price."""
    if price >= relaxation.high[m]:
        return price / (1 - relaxation.discount)
    total = 0.0
    if price <= relaxation.low[m]:
        for i in range(belief.shape[1]):
            total += belief[g, i] * relaxation.worth[m, i]
        return total
    rung, blend = _rung(relaxation, m, price)
    value = relaxation.value
    start = value.start[m] + rung * value.size[m]
    for j in range(value.states[m]):
        below = value.values[start + located[0][g, j]]
        above = value.values[start + value.size[m] + located[0][g, j]]
        total += located[1][g, j] * (below + blend * (above - below))
    return total
