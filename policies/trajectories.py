"""Simulated trajectories of one first action, compiled.

Trajectories that have had the same plays and answers so far are simulated together:
they are a range of `Sample.members`, which splits where their next answers differ. That
gives the sum over separate trajectories, for the work of the distinct ones: after h
answers there are at most K^h.
"""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner
from policies.draws import Draws
from policies.tree import (
    CHOSEN,
    Tree,
    answer,
    chances_of,
    pass_slot,
    play_base,
    reward_of,
    touch,
)


class Sample(NamedTuple):
    """What is simulated beside the tree.

    Attributes:
        draws: random numbers.
        weights: (T,) worth of the reward of each play, the first action's included.
        click: whether a reward is that of the signal, else what is expected.
        members: (L,) trajectories, in an order in which those that share the path lie
            side by side.
        end: (T,) where the range of trajectories ends that share the path down to h.
        upto: (T, K) the signals in the order in which they are drawn, the last one
            first, are those below these numbers.
        last: (G,) number after a group's last item; items are numbered through.
    """

    draws: Draws
    weights: Floats
    click: bool
    members: Ints
    end: Ints
    upto: Floats
    last: Ints


@compiled
def sampled(
    tree: Tree, draws: Draws, literal: bool, click: bool, discount: float
) -> Sample:
    """Make room for the trajectories of one first action.

    In the reading "tail", its own reward is left out.
    """
    levels, trajectories = draws.answers.shape
    weights = np.zeros(levels)
    for h in range(levels):
        if literal:
            weights[h] = discount * tree.level[h].power
        elif h > 0:
            weights[h] = tree.level[h].power
    return Sample(
        draws,
        weights,
        click,
        np.empty(trajectories, dtype=np.int64),
        np.empty(levels, dtype=np.int64),
        np.empty((levels, tree.moves.observe.shape[1])),
        np.cumsum(tree.size),
    )


@compiled
def total_reward(
    tree: Tree, sample: Sample, candidate: int, start: int, stop: int
) -> float:
    """Sum the weighted rewards of trajectories after playing `candidate` first.

    Equal candidates have equal sums to the bit, so that they tie.

    Args:
        tree: planted.
        sample: with the random numbers of this candidate drawn.
        candidate: row of the group whose first item is played first.
        start: first trajectory.
        stop: after the last one.
    """
    before = tree.level[0].touched
    random = len(sample.draws.items) > 0
    for k in range(before):
        tree.item[k].number = sample.last[-1] + k
    for place in range(start, stop):
        sample.members[place] = place
    total, first = 0.0, start
    while first < stop:
        touch(tree, 0, candidate)
        tree.item[before].number = sample.last[candidate] - tree.size[candidate]
        sample.end[0] = first + 1 if random else stop
        total += _walk(tree, sample, first)
        first = sample.end[0]
        tree.level[0].touched = before
    return total


@inner
def _walk(tree: Tree, sample: Sample, first: int) -> float:
    """Sum the rewards of the trajectories from `first` to the end of the path's root.

    Depth first. Of the trajectories at a node, those that answer like the first one go
    on; the others, if any, are met on the way back, and then all answer alike.
    """
    stop, last = sample.end[0], len(sample.weights) - 1
    total, h = 0.0, 0
    arriving = True
    while first < stop:
        if arriving:
            _expect(tree, sample, h)
        total += _reward(tree, sample, h, first) if arriving else 0.0
        if h < last:
            if arriving:
                pass_slot(tree, h)
            answer(tree, h, _split(tree, sample, h, first))
            h += 1
            _play_next(tree, sample, h, first)
            arriving = True
        else:
            first = sample.end[h]
            while h > 0 and sample.end[h] == first:
                h -= 1
            arriving = False
    return total


@inner
def _play_next(tree: Tree, sample: Sample, h: int, first: int) -> None:
    """Let the base play at level h."""
    tree.level[h].touched = tree.level[h - 1].touched
    if len(sample.draws.items) == 0:
        play_base(tree, 0, h)
    else:
        _play_number(tree, sample, h, sample.draws.items[h, sample.members[first]])


@inner
def _play_number(tree: Tree, sample: Sample, h: int, drawn: float) -> None:
    """Play an item drawn from those that this slot has not played."""
    total, touched, slot = sample.last[-1], tree.level[h].touched, tree.level[h].slot
    room, gone = len(tree.item), 0
    for k in range(touched):
        total += tree.item[k].group == CHOSEN
        gone += tree.since[h * room + k] == slot
    number, passed = int(drawn * (total - gone)), -1
    while gone > 0:  # in ascending order, step over those that are played
        lowest = total
        for k in range(touched):
            other = tree.item[k].number
            if tree.since[h * room + k] == slot and passed < other < lowest:
                lowest = other
        if lowest > number:
            break
        number, passed, gone = number + 1, lowest, gone - 1
    for k in range(touched):
        if tree.item[k].number == number:
            tree.level[h].played = k
            return
    low, high = 0, len(sample.last) - 1
    while low < high:
        middle = (low + high) // 2
        if sample.last[middle] > number:
            high = middle
        else:
            low = middle + 1
    touch(tree, h, low)
    tree.item[touched].number = number


@inner
def _expect(tree: Tree, sample: Sample, h: int) -> None:
    """Work out which random numbers lead to which signal of the play at level h.

    The last signal that can be given takes what rounding leaves.
    """
    k = tree.level[h].played
    at, m = h * len(tree.item) + k, tree.item[k].model
    signals, upto, final = tree.moves.signals[m], 0.0, 0
    chances = chances_of(tree, h, m)
    for place in range(signals):
        chance = 0.0
        for i in range(tree.belief.shape[1]):
            told = tree.moves.observe[chances, signals - 1 - place, i]
            chance += tree.belief[at, i] * told
        upto += chance
        sample.upto[h, place] = upto
        final = place if chance > 0.0 else final
    for place in range(final, signals):
        sample.upto[h, place] = np.inf


@inner
def _signal(tree: Tree, sample: Sample, h: int, place: int) -> int:
    """Return the signal that the trajectory at a place gives at level h."""
    drawn, number = sample.draws.answers[h, sample.members[place]], 0
    while drawn >= sample.upto[h, number]:
        number += 1
    return int(tree.moves.signals[tree.item[tree.level[h].played].model] - 1 - number)


@inner
def _reward(tree: Tree, sample: Sample, h: int, first: int) -> float:
    """Sum the weighted rewards of the trajectories at a node for its play."""
    if not sample.click:
        count = sample.end[h] - first
        return float(sample.weights[h]) * int(count) * reward_of(tree, h)
    m, total = tree.item[tree.level[h].played].model, 0.0
    for place in range(first, sample.end[h]):
        total += tree.moves.reward[m, _signal(tree, sample, h, place)]
    return float(sample.weights[h]) * total


@inner
def _split(tree: Tree, sample: Sample, h: int, first: int) -> int:
    """Bring together the trajectories that answer like the first; return its signal."""
    members = sample.members
    signal = _signal(tree, sample, h, first)
    end = first + 1
    for place in range(end, sample.end[h]):
        if _signal(tree, sample, h, place) == signal:
            other = members[place]
            members[place] = members[end]
            members[end] = other
            end += 1
    sample.end[h + 1] = end
    return signal
