"""One item for itself, paid a subsidy for each slot in which it rests.

Whittle (1988): V(pi) = max(r(pi) + beta E V(pi after a play), w + beta V(pi P0)) for a
subsidy w. The advantage of playing is the first less the second; the index of a belief
is the subsidy at which it is zero. V is convex in the belief, so that value iteration
on a grid, with interpolation, gives an upper bound of V (Lovejoy 1991).
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from policies import grid
from policies.arrays import Floats, Ints
from policies.bayes import learn, like_chance, move
from policies.compiled import compiled
from policies.model_set import ModelSet

Moves: TypeAlias = tuple[Floats, Ints, Floats, Ints, Floats]

MOST_SWEEPS = 100_000


class Arm(NamedTuple):
    """An item's moves between the P points of a grid of beliefs.

    Attributes:
        reward: (P,) r(pi).
        played: (P, K S) ranks of the corners around the beliefs after each signal.
        chance: (P, K S) their weights, times the chance of the signal.
        rested: (P, S) ranks of the corners around the belief after a slot of rest.
        share: (P, S) their weights.
        reached: (P,) whether the prior leads there, by any plays, answers and rests;
            as corners around a belief, so that no belief is missed.
        discount: beta.
    """

    reward: Floats
    played: Ints
    chance: Floats
    rested: Ints
    share: Floats
    reached: NDArray[np.bool_]
    discount: float


def arm(models: ModelSet, m: int, divisions: int, discount: float) -> Arm:
    """Work out the moves of model m, in its mean mood, between the points of a grid."""
    states = int(models.states[m])
    belief = grid.beliefs(states, divisions)
    wide = np.zeros((len(belief), models.like.shape[1]))
    wide[:, :states] = belief
    steps = grid.steps(states, divisions)
    room = grid.corners(states)
    moves = _moves(models, m, wide, steps, divisions, room)
    grid.find(steps, states, divisions, models.prior, m, room)
    first = room["rank"][room["weight"] > 0]
    return Arm(*moves, _reached(moves, first), float(discount))


def on_reached(arm: Arm) -> Arm:
    """Leave out all points that the prior does not lead to; no move leads to them."""
    kept = arm.reached
    rank = np.cumsum(kept) - 1
    played = np.where(arm.chance[kept] > 0, rank[arm.played[kept]], 0)
    rested = np.where(arm.share[kept] > 0, rank[arm.rested[kept]], 0)
    return Arm(
        arm.reward[kept],
        played,
        arm.chance[kept],
        rested,
        arm.share[kept],
        kept[kept],
        arm.discount,
    )


def worth(models: ModelSet, discount: float) -> Floats:
    """Return (M, S): discounted rewards of playing for ever, (I - beta P1)^-1 rho.

    Each model is solved for itself: the bits do not depend on its company.
    """
    found = np.zeros_like(models.like)
    for m, states in enumerate(models.states.tolist()):
        kept = np.eye(states) - discount * models.play[m, :states, :states]
        found[m, :states] = np.linalg.solve(kept, models.like[m, :states])
    return found


def range_of(models: ModelSet, m: int, discount: float) -> tuple[float, float]:
    """Return subsidies up to which playing is always best, and from which resting is.

    Every index lies between them. With v the worth of playing for ever, playing always
    is best while the least entry of rho + beta (P1 - P0) v is no less than the subsidy:
    the advantage is linear in the belief then, and least in a corner. Resting always is
    best once no state's reward exceeds it.
    """
    states = int(models.states[m])
    play, rest = models.play[m, :states, :states], models.rest[m, :states, :states]
    like = models.like[m, :states]
    ever = worth(models, discount)[m, :states]
    return float((like + discount * (play - rest) @ ever).min()), float(like.max())


@compiled
def solve(
    arm: Arm, subsidy: float, value: Floats, advantage: Floats, tolerance: float
) -> int:
    """Improve `value` (P,) in place until it is the value at this subsidy.

    The end is an upper bound of the fixed point, by at most `tolerance` (MacQueen
    1966): a sweep that changes all values between a and b shows that the fixed point
    is at most b beta / (1 - beta) above its outcome. The advantage (P,) of playing is
    written, too.

    Returns:
        The number of sweeps.
    """
    horizon = arm.discount / (1 - arm.discount)
    after = np.empty_like(value)
    for sweep in range(MOST_SWEEPS):
        low, high = np.inf, -np.inf
        for point in range(len(value)):
            play, rest = 0.0, 0.0
            for j in range(arm.played.shape[1]):
                play += arm.chance[point, j] * value[arm.played[point, j]]
            for j in range(arm.rested.shape[1]):
                rest += arm.share[point, j] * value[arm.rested[point, j]]
            play = arm.reward[point] + arm.discount * play
            rest = subsidy + arm.discount * rest
            advantage[point] = play - rest
            after[point] = max(play, rest)
            low = min(low, after[point] - value[point])
            high = max(high, after[point] - value[point])
        close = (high - low) * horizon <= tolerance
        shift = horizon * (high if close else (low + high) / 2)
        for point in range(len(value)):
            value[point] = after[point] + shift
        if close:
            return sweep + 1
    return MOST_SWEEPS


@compiled
def advantages(arm: Arm, prices: Floats, value: Floats) -> Floats:
    """Return (L, P): the advantage of playing at each of L subsidies with V (L, P)."""
    found = np.empty_like(value)
    for rung in range(len(prices)):
        for point in range(value.shape[1]):
            play, rest = 0.0, 0.0
            for j in range(arm.played.shape[1]):
                play += arm.chance[point, j] * value[rung, arm.played[point, j]]
            for j in range(arm.rested.shape[1]):
                rest += arm.share[point, j] * value[rung, arm.rested[point, j]]
            ahead = arm.discount * (play - rest)
            found[rung, point] = arm.reward[point] + ahead - prices[rung]
    return found


@compiled
def _moves(
    models: ModelSet,
    m: int,
    belief: Floats,
    steps: Ints,
    divisions: int,
    corners: grid.Corners,
) -> Moves:
    points, states, signals = len(belief), models.states[m], models.signals[m]
    reward = np.empty(points)
    played = np.zeros((points, signals * states), dtype=np.int64)
    chance = np.zeros((points, signals * states))
    rested = np.zeros((points, states), dtype=np.int64)
    share = np.zeros((points, states))
    after = np.empty((1, belief.shape[1]))
    for point in range(points):
        reward[point] = like_chance(models.like, m, belief, point)
        for signal in range(signals):
            told = learn(
                models.observe, m, models.play, m, belief, point, signal, after, 0
            )
            grid.locate(steps, states, divisions, after, 0, corners)
            for j in range(states):
                played[point, signal * states + j] = corners[j].rank
                chance[point, signal * states + j] = told * corners[j].weight
        move(models.rest, m, belief, point, after, 0)
        grid.locate(steps, states, divisions, after, 0, corners)
        for j in range(states):
            rested[point, j] = corners[j].rank
            share[point, j] = corners[j].weight
    return reward, played, chance, rested, share


@compiled
def _reached(moves: Moves, first: Ints) -> NDArray[np.bool_]:
    """Follow all moves from some points, as far as they lead."""
    _, played, chance, rested, share = moves
    reached = np.zeros(len(played), dtype=np.bool_)
    waiting = np.empty(len(played), dtype=np.int64)
    last = -1
    for point in first:
        reached[point] = True
        last += 1
        waiting[last] = point
    while last >= 0:
        point = waiting[last]
        last -= 1
        for targets, weights in ((played, chance), (rested, share)):
            for j in range(targets.shape[1]):
                target = targets[point, j]
                if weights[point, j] > 0.0 and not reached[target]:
                    reached[target] = True
                    last += 1
                    waiting[last] = target
    return reached
