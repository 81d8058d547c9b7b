"""Full look-ahead of some plays, then base policies: what each first play is worth.

With the items of a candidate's group g and its signals y,

    Q(g) = r(g) + sum_y P(y) V(after y)

where V is the best next play's Q while look-ahead lasts, and then what the best of the
base policies earns. Most candidates, once played, are not played again by a base: their
futures are one and the same, and are followed once. Others are left out if they cannot
win even in the best case.
"""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.bayes import IMPOSSIBLE, like_chance, move
from policies.compiled import compiled, inner, variable
from policies.index import value_of
from policies.moves import are_moody, lift_of, row_in
from policies.tree import (
    NO_LEAF,
    SUM_LEAF,
    Tree,
    answer,
    excess,
    feel,
    follow,
    left,
    liked,
    pass_slot,
    reward_of,
    touch,
)

ROUNDING = 1e-12  # what rounding may have taken from a bound


class Ceiling(NamedTuple):
    """What no item of a model can exceed, by any plays and answers.

    Attributes:
        reward: (M,) expected reward in the next slot, in any mood.
        leaf: (M,) worth of playing for ever.
    """

    reward: Floats
    leaf: Floats


class Shared(NamedTuple):
    """What the bases earn if the candidate is not played again.

    Attributes:
        value: (W, B), by the mood that the candidate's answer leads to: W is 2, row 1
            after a like; or 1 where there are no moods.
        lowest: (B, T + 1, C) see `Tree`.
        used: (B, G) see `Tree`.
        most: (T + 2,) more than which nothing can earn from a level on; infinite where
            that is not known.
    """

    value: Floats
    lowest: Floats
    used: Ints
    most: Floats


@compiled
def first_plays(tree: Tree, depth: int, ceiling: Ceiling, prune: bool) -> Floats:
    """Return (G,): Q of each group; of one that cannot win, what it is worth at most.

    Args:
        tree: planted.
        depth: plays of full look-ahead, the first one included, D >= 1.
        ceiling: for pruning.
        prune: whether to leave out what cannot win.
    """
    total = len(tree.group)
    shared = _shared(tree, depth, ceiling)
    scores = np.empty(total)
    exact = np.zeros(total, dtype=np.bool_)
    best = -np.inf
    for g in range(total):
        scores[g], exact[g] = _first_play(tree, g, depth, shared, variable(1))
        if exact[g]:
            best = max(best, scores[g])
    for _ in range(total):
        most = variable(-1)
        for g in range(total):
            if not exact[g] and (most < 0 or scores[g] > scores[most]):
                most = g
        if most < 0 or (prune and scores[most] < best - ROUNDING):
            break
        scores[most], _ = _first_play(tree, most, depth, shared, variable(0))
        exact[most] = True
        best = max(best, scores[most])
    return scores


@compiled
def _shared(tree: Tree, depth: int, ceiling: Ceiling) -> Shared:
    """Follow the bases from level 1 as if nothing were played at level 0."""
    value = np.zeros((2 if are_moody(tree.moves) else 1, tree.bases))
    if depth == 1:
        tree.level[0].played = -1
        pass_slot(tree, 0)
        for way in range(len(value)):
            if are_moody(tree.moves):
                feel(tree.moves.rule, tree.level, 0, way)
            for b in range(tree.bases):
                value[way, b] = follow(tree, b, variable(1))
    return Shared(value, tree.lowest.copy(), tree.used.copy(), _most(tree, ceiling))


@compiled
def _most(tree: Tree, ceiling: Ceiling) -> Floats:
    end = len(tree.level) - 1
    if tree.leaf == SUM_LEAF:
        return np.full(end + 2, np.inf)
    most, reward, leaf = np.zeros(end + 2), 0.0, 0.0
    for k in range(tree.level[0].touched):
        reward = max(reward, ceiling.reward[tree.item[k].model])
        leaf = max(leaf, ceiling.leaf[tree.item[k].model])
    for g in range(len(tree.group)):
        m = tree.group[g]
        reward = max(reward, ceiling.reward[m])
        for mood in range(tree.moves.classes):  # of another play in this slot
            chances = row_in(tree.moves, m, mood)
            now = like_chance(tree.moves.like, chances, tree.schedule.belief, g)
            reward = max(reward, now)
        leaf = max(leaf, ceiling.leaf[m])
    most[end] = tree.level[end].power * leaf if tree.leaf != NO_LEAF else 0.0
    for h in range(end - 1, -1, -1):
        most[h] = most[h + 1] + tree.level[h].power * reward
    return most


@compiled
def _first_play(
    tree: Tree, g: int, depth: int, shared: Shared, bounded: int
) -> tuple[float, bool]:
    """Return Q of group g, and whether it is exact.

    If `bounded` is 1, no tree is followed: where one would have to be, the most that it
    could give stands in its place.
    """
    before, exact = tree.level[0].touched, True
    touch(tree, 0, g)
    total = tree.schedule.reward[g]
    pass_slot(tree, 0)
    for signal in range(tree.moves.signals[tree.group[g]]):
        chance = answer(tree, 0, signal)
        if chance < IMPOSSIBLE:
            continue
        future = -np.inf
        if depth > 1:
            exact = exact and bounded == 0
            future = shared.most[1]
            if bounded == 0:
                future = _best(tree, variable(1), depth, shared.most)
        way = liked(tree, tree.group[g], signal) if are_moody(tree.moves) else 0
        for b in range(tree.bases if depth == 1 else 0):
            apart, value = _apart(tree, b, g, way, shared)
            if not apart:
                exact = exact and bounded == 0
                value = shared.most[1] if bounded == 1 else follow(tree, b, variable(1))
            future = max(future, value)
        total += chance * future
    tree.level[0].touched = before
    return total, exact


@inner
def _apart(tree: Tree, b: int, g: int, way: int, shared: Shared) -> tuple[bool, float]:
    """Say whether base b never plays the candidate again, and what it earns then.

    The candidate, of group g, has been answered; from level 1 on it rests. `way` is the
    row of what is shared.
    """
    if shared.used[b, g] >= tree.size[g]:
        return False, 0.0
    end, room, k = len(tree.level) - 1, len(tree.item), tree.level[0].touched - 1
    for h in range(1, end + 1):
        at = h * room + k
        if h > 1:
            _rest_alone(tree, h - 1, k)
        if tree.level[h].slot == tree.level[0].slot:
            continue
        rested = float(tree.level[h].slot - tree.level[0].slot - 1)
        if _wanted(tree, b, h, at, tree.item[k].model, rested, shared):
            return False, 0.0
    own = tree.level[end].power * excess(tree, end, k) if tree.leaf == SUM_LEAF else 0.0
    return True, shared.value[way, b] + own


@inner
def _wanted(
    tree: Tree, b: int, h: int, at: int, m: int, rested: float, shared: Shared
) -> bool:
    """Say whether base b might play an item at level h, in a mood that it was in."""
    score = value_of(tree.scores, b, m, tree.belief, at, rested, tree.corners)
    if not are_moody(tree.moves):
        return bool(score >= shared.lowest[b, h, 0])
    lifts = tree.scores.place[b, m].lifts == 1
    for mood in range(tree.moves.classes):
        if shared.lowest[b, h, mood] == np.inf:
            continue
        lift = lift_of(tree.moves, m, mood, tree.belief, at) if lifts else 0.0
        if score + lift >= shared.lowest[b, h, mood]:
            return True
    return False


@inner
def _rest_alone(tree: Tree, h: int, k: int) -> None:
    """Move one touched item on from level h, at which it rests."""
    at, room = h * len(tree.item) + k, len(tree.item)
    if tree.level[h + 1].slot > tree.level[h].slot > tree.level[0].slot:
        move(
            tree.moves.rest, tree.item[k].model, tree.belief, at, tree.belief, at + room
        )
        return
    for i in range(tree.belief.shape[1]):
        tree.belief[at + room, i] = tree.belief[at, i]


@compiled
def _best(tree: Tree, h: int, depth: int, most: Floats) -> float:
    """Return the best Q of a play at level h < `depth`."""
    total, before = len(tree.group), tree.level[h].touched
    best = -np.inf
    for choice in range(total + before):
        if not _take(tree, h, choice):
            continue
        m = tree.item[tree.level[h].played].model
        worth = tree.level[h].power * reward_of(tree, h)
        if worth + most[h + 1] >= best:
            pass_slot(tree, h)
            for signal in range(tree.moves.signals[m]):
                chance = answer(tree, h, signal)
                if chance < IMPOSSIBLE:
                    continue
                future = -np.inf
                if h + 1 < depth:
                    future = _best(tree, h + 1, depth, most)
                for b in range(tree.bases if h + 1 == depth else 0):
                    future = max(future, follow(tree, b, h + 1))
                worth += chance * future
            best = max(best, worth)
        tree.level[h].touched = before
    return best


@inner
def _take(tree: Tree, h: int, choice: int) -> bool:
    """Play an item of a group, or else a touched item, if it can be played."""
    total = len(tree.group)
    if choice < total:
        if left(tree, h, choice) == 0:
            return False
        touch(tree, h, choice)
        return True
    tree.level[h].played = choice - total
    at = h * len(tree.item) + choice - total
    return bool(tree.since[at] != tree.level[h].slot)
