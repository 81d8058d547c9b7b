"""Simulated trajectories of one first action, compiled.

The items played in a trajectory are its touched ones, at most one more with each play;
all others follow the schedule. Trajectories that have had the same plays and answers so
far are simulated together: they are a range of `Path.members`, which splits where their
next answers differ. That gives the sum over separate trajectories, for the work of the
distinct ones: after h answers there are at most 2^h.
"""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.bayes import LIKE, SKIP, learn, like_chance, move
from policies.compiled import compiled
from policies.draws import Draws
from policies.model_set import ModelSet
from policies.schedule import Groups, Schedule


class Path(NamedTuple):
    """The plays from the first action to the current one, at depths h < D.

    Attributes:
        members: (L,) trajectories, in an order in which those that share the path lie
            side by side.
        end: (D,) where the range of trajectories ends that share the path down to h.
        touched: (D,) number of touched items at h, k.
        played: (D,) which of them is played at h.
        chance: (D,) chance of a like of that play.
        item: (D,) ordinal of the k-th touched item.
        group: (D,) its group.
        belief: (D * D, S) belief at h of the k-th touched item, in row h D + k.
    """

    members: Ints
    end: Ints
    touched: Ints
    played: Ints
    chance: Floats
    item: Ints
    group: Ints
    belief: Floats


class Imagined(NamedTuple):
    """All that a simulation reads and writes."""

    models: ModelSet
    groups: Groups
    schedule: Schedule
    draws: Draws
    path: Path


@compiled
def empty_path(plays: int, trajectories: int, states: int) -> Path:
    """Make room for a path."""
    return Path(
        np.arange(trajectories),
        np.empty(plays, dtype=np.int64),
        np.empty(plays, dtype=np.int64),
        np.empty(plays, dtype=np.int64),
        np.empty(plays),
        np.empty(plays, dtype=np.int64),
        np.empty(plays, dtype=np.int64),
        np.empty((plays * plays, states)),
    )


@compiled
def total_reward(
    imagined: Imagined, weights: Floats, click: bool, candidate: int
) -> float:
    """Sum the weighted rewards of all trajectories after playing `candidate` first.

    Args:
        imagined: with the random numbers of this candidate drawn.
        weights: (D,) worth of the reward at each depth.
        click: whether a reward is the answer, not its chance.
        candidate: row of the group whose first item is played first.
    """
    path = imagined.path
    shared = len(imagined.draws.items) == 0
    path.touched[0] = 0
    count = imagined.groups.count[candidate]
    _touch(imagined, 0, candidate, imagined.schedule.last[candidate] - count)
    total, first = 0.0, 0
    while first < len(path.members):
        path.end[0] = len(path.members) if shared else first + 1
        total += _walk(imagined, weights, click, first)
        first = path.end[0]
    return total


@compiled
def _walk(imagined: Imagined, weights: Floats, click: bool, first: int) -> float:
    """Sum the rewards of the trajectories from `first` to the end of the path's root.

    Depth first. Of the trajectories at a node, those that answer like the first one go
    on; the others, if any, are met on the way back, and then all answer alike.
    """
    path = imagined.path
    stop = path.end[0]
    h = 0
    total = _reward(imagined, weights, click, h, first)
    while first < stop:
        while h + 1 < len(weights):
            signal = _split(imagined, h, first)
            h += 1
            _follow(imagined, h, signal)
            _play_next(imagined, h, first)
            total += _reward(imagined, weights, click, h, first)
        first = path.end[h]
        while h > 0 and path.end[h] == first:
            h -= 1
    return total


@compiled
def _reward(
    imagined: Imagined, weights: Floats, click: bool, h: int, first: int
) -> float:
    """Sum the weighted rewards of the trajectories at a node for its play."""
    path = imagined.path
    if not click:
        return weights[h] * path.chance[h] * (path.end[h] - first)
    likes = 0
    for place in range(first, path.end[h]):
        likes += imagined.draws.answers[h, path.members[place]] < path.chance[h]
    return weights[h] * likes


@compiled
def _split(imagined: Imagined, h: int, first: int) -> int:
    """Bring together the trajectories that answer like the first; return its answer."""
    members, answers = imagined.path.members, imagined.draws.answers
    chance = imagined.path.chance[h]
    liked = answers[h, members[first]] < chance
    end = first + 1
    for place in range(end, imagined.path.end[h]):
        member = members[place]
        if (answers[h, member] < chance) == liked:
            members[place] = members[end]
            members[end] = member
            end += 1
    imagined.path.end[h + 1] = end
    return LIKE if liked else SKIP


@compiled
def _follow(imagined: Imagined, h: int, signal: int) -> None:
    """Move the touched items' beliefs on to depth h, after the answer at h - 1."""
    models, belief = imagined.models, imagined.path.belief
    plays = len(imagined.path.end)
    touched = imagined.path.touched[h - 1]
    imagined.path.touched[h] = touched
    for k in range(touched):
        m = imagined.groups.model[imagined.path.group[k]]
        row = h * plays + k
        if k == imagined.path.played[h - 1]:
            learn(models, m, belief, row - plays, signal, belief, row)
        else:
            move(models.rest, m, belief, row - plays, belief, row)


@compiled
def _play_next(imagined: Imagined, h: int, first: int) -> None:
    """Let the base play at depth h."""
    if len(imagined.draws.items) == 0:
        _play_best(imagined, h)
    else:
        _play_item(imagined, h, imagined.draws.items[h, imagined.path.members[first]])


@compiled
def _play_item(imagined: Imagined, h: int, item: int) -> None:
    path = imagined.path
    for k in range(path.touched[h]):
        if path.item[k] == item:
            m = imagined.groups.model[path.group[k]]
            path.played[h] = k
            row = h * len(path.end) + k
            path.chance[h] = like_chance(imagined.models.like, m, path.belief, row)
            return
    g = np.searchsorted(imagined.schedule.last, item, side="right")
    _touch(imagined, h, g, item)


@compiled
def _play_best(imagined: Imagined, h: int) -> None:
    """Play the item most likely to be liked; ties: lowest group, untouched, oldest."""
    path = imagined.path
    row = _best_untouched(imagined, h)
    chance = -1.0 if row < 0 else imagined.schedule.like[h, row]
    best = -1
    for k in range(path.touched[h]):
        g = path.group[k]
        m = imagined.groups.model[g]
        value = like_chance(imagined.models.like, m, path.belief, h * len(path.end) + k)
        if value > chance or (value == chance and g < row):
            best, row, chance = k, g, value
    if best < 0:
        _touch(imagined, h, row, -1)
    else:
        path.played[h] = best
        path.chance[h] = chance


@compiled
def _best_untouched(imagined: Imagined, h: int) -> int:
    """Return the best group at depth h that has an untouched item left, or -1."""
    path = imagined.path
    for rank in range(imagined.schedule.order.shape[1]):
        g = imagined.schedule.order[h, rank]
        left = imagined.groups.count[g]
        for k in range(path.touched[h]):
            left -= path.group[k] == g
        if left > 0:
            return g
    return -1


@compiled
def _touch(imagined: Imagined, h: int, group: int, item: int) -> None:
    """Play an item of `group` at depth h that was not played before it."""
    path = imagined.path
    k = path.touched[h]
    path.touched[h] = k + 1
    path.played[h] = k
    path.chance[h] = imagined.schedule.like[h, group]
    path.item[k] = item
    path.group[k] = group
    row = h * len(imagined.groups.model) + group
    for i in range(path.belief.shape[1]):
        path.belief[h * len(path.end) + k, i] = imagined.schedule.belief[row, i]
