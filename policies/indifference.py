"""The subsidy at which playing and resting one item earn the same, by simulation.

Trajectories of the item alone begin with a play, or with a rest; from then on it is
played where that earns more at once than the subsidy. The subsidy follows the
difference of what both earn, in ever smaller steps.
"""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.bayes import learn, like_chance, move
from policies.compiled import compiled, inner
from policies.model_set import ModelSet
from policies.randomness import SUBSIDIES, uniform

FAST = 0.6  # step n of the averages is n^-FAST, that of the subsidy n^-SLOW:
SLOW = 0.8  # against the averages, the subsidy stands still in the end


class Search(NamedTuple):
    """A search's parameters as compiled code takes them.

    Attributes:
        weights: (H,) worth of the reward of each slot, the first one's included.
        trajectories: L.
        iterations: most steps of the subsidy.
        tolerance: the search ends when playing and resting differ by less.
        click: whether a play earns the reward of its signal, else the expected one.
    """

    weights: Floats
    trajectories: int
    iterations: int
    tolerance: float
    click: bool


class _Branch(NamedTuple):
    """The branch of a trajectory that is being simulated, at depths h < H.

    Trajectories that have had the same signals so far are simulated together: a range
    of `members`, which splits where the next signals differ.

    Attributes:
        draws: (H, L) random numbers in [0, 1).
        members: (L,) trajectories; those that share the branch lie side by side.
        end: (H,) where the range of trajectories ends that share it down to h.
        played: (H,) 1 if the item is played, 0 if it rests.
        belief: (H, S).
        limits: (H, K) below which a random number gives a signal, or one after it.
    """

    draws: Floats
    members: Ints
    end: Ints
    played: Ints
    belief: Floats
    limits: Floats


class _Imagined(NamedTuple):
    """All that a simulation reads and writes."""

    models: ModelSet
    search: Search
    branch: _Branch


@compiled
def subsidies(
    models: ModelSet, model: Ints, belief: Floats, search: Search, seed: int
) -> Floats:
    """Return (G,): the subsidy of each belief; equal ones have the same, to the bit.

    Args:
        models: M models of S states, taken in their mean mood.
        model: (G,) row of each belief's model.
        belief: (G, S).
        search: how to search.
        seed: of the random numbers, which all beliefs and steps share.
    """
    slots, trajectories = len(search.weights), search.trajectories
    branch = _Branch(
        np.empty((slots, trajectories)),
        np.empty(trajectories, dtype=np.int64),
        np.empty(slots, dtype=np.int64),
        np.empty(slots, dtype=np.int64),
        np.empty((slots, belief.shape[1])),
        np.empty((slots, models.observe.shape[1])),
    )
    for h in range(slots):
        for t in range(trajectories):
            branch.draws[h, t] = uniform(seed, SUBSIDIES, t, h)
    imagined = _Imagined(models, search, branch)
    found = np.empty(len(model))
    for g in range(len(model)):
        for i in range(belief.shape[1]):
            branch.belief[0, i] = belief[g, i]
        found[g] = _search(imagined, model[g])
    return found


@inner
def _search(imagined: _Imagined, m: int) -> float:
    """Return the subsidy of the belief at depth 0.

    The averages may agree in passing, so the latest values have to agree as well.
    """
    search = imagined.search
    subsidy = like_chance(imagined.models.like, m, imagined.branch.belief, 0)
    average = 0.0
    for step in range(1, search.iterations + 1):
        latest = 0.0
        for first_action in range(2):
            total = _total(imagined, m, subsidy, first_action) / search.trajectories
            latest = total - latest  # of a play, less that of a rest
        average += step**-FAST * (latest - average)
        subsidy += step**-SLOW * average
        if max(abs(average), abs(latest)) < search.tolerance:
            break
    return subsidy


@inner
def _total(imagined: _Imagined, m: int, subsidy: float, first_action: int) -> float:
    """Sum the weighted rewards of all trajectories.

    Depth first. Of the trajectories at a node, those of the same signal as the first
    one go on; the others are met on the way back.
    """
    branch, like = imagined.branch, imagined.models.like
    for place in range(len(branch.members)):
        branch.members[place] = place
    branch.end[0] = len(branch.members)
    branch.played[0] = first_action
    total, first, h = 0.0, 0, 0
    while True:
        if branch.played[h] == 1:
            _limit(imagined, m, h)
        total += _reward(imagined, m, subsidy, h, first)
        if h + 1 == len(branch.end):
            first = branch.end[h]
            if first == len(branch.members):
                return total
            while branch.end[h] == first:
                h -= 1
        _follow(imagined, m, h, first)
        h += 1
        branch.played[h] = like_chance(like, m, branch.belief, h) > subsidy


@inner
def _limit(imagined: _Imagined, m: int, h: int) -> None:
    """Write the chances of each signal or a later one."""
    models, branch = imagined.models, imagined.branch
    limit = 0.0
    for signal in range(models.signals[m] - 1, -1, -1):
        for i in range(branch.belief.shape[1]):
            limit += branch.belief[h, i] * models.observe[m, signal, i]
        branch.limits[h, signal] = limit


@inner
def _reward(imagined: _Imagined, m: int, subsidy: float, h: int, first: int) -> float:
    """Sum the weighted rewards of the trajectories at a node."""
    models, branch = imagined.models, imagined.branch
    weight, members = float(imagined.search.weights[h]), int(branch.end[h] - first)
    if branch.played[h] == 0:
        return weight * subsidy * members
    if not imagined.search.click:
        return weight * like_chance(models.like, m, branch.belief, h) * members
    total = 0.0
    for place in range(first, branch.end[h]):
        total += float(models.reward[m, _signal(imagined, m, h, place)])
    return weight * total


@inner
def _follow(imagined: _Imagined, m: int, h: int, first: int) -> None:
    """Move on to depth h + 1, with all that have the signal of the first."""
    models, branch = imagined.models, imagined.branch
    if branch.played[h] == 0:
        branch.end[h + 1] = branch.end[h]
        move(models.rest, m, branch.belief, h, branch.belief, h + 1)
        return
    signal, end = 0, first
    for place in range(first, branch.end[h]):
        own = _signal(imagined, m, h, place)
        if place == first or own == signal:
            member = branch.members[place]
            branch.members[place] = branch.members[end]
            branch.members[end] = member
            signal, end = own, end + 1
    branch.end[h + 1] = end
    belief = branch.belief
    learn(models.observe, m, models.play, m, belief, h, signal, belief, h + 1)


@inner
def _signal(imagined: _Imagined, m: int, h: int, place: int) -> int:
    """Draw the signal of a trajectory; the lowest random numbers give the last one."""
    branch = imagined.branch
    draw = branch.draws[h, branch.members[place]]
    signal = int(imagined.models.signals[m]) - 1
    while signal > 0 and draw >= branch.limits[h, signal]:
        signal -= 1
    return signal
