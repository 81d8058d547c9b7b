"""Simulated trajectories of one first action, compiled.

Trajectories that have had the same plays and answers so far are simulated together:
they are a range of `Path.members`, which splits where their next answers differ. That
gives the sum over separate trajectories, for the work of the distinct ones: after h
answers there are at most 2^h.
"""

from policies.base import play_next
from policies.bayes import LIKE, SKIP, learn, move
from policies.compiled import inner
from policies.path import Imagined, touch


@inner
def total_reward(imagined: Imagined, candidate: int) -> float:
    """Sum the weighted rewards of all trajectories after playing `candidate` first.

    Equal candidates have equal sums to the bit, so that they tie.

    Args:
        imagined: with the random numbers of this candidate drawn.
        candidate: row of the group whose first item is played first.
    """
    path = imagined.path
    shared = len(imagined.draws.items) == 0
    for place in range(len(path.members)):
        path.members[place] = place
    path.touched[0] = 0
    count = imagined.groups.size[candidate]
    touch(imagined, 0, candidate, imagined.schedule.last[candidate] - count)
    total, first = 0.0, 0
    while first < len(path.members):
        path.end[0] = len(path.members) if shared else first + 1
        total += _walk(imagined, first)
        first = path.end[0]
    return total


@inner
def _walk(imagined: Imagined, first: int) -> float:
    """Sum the rewards of the trajectories from `first` to the end of the path's root.

    Depth first. Of the trajectories at a node, those that answer like the first one go
    on; the others, if any, are met on the way back, and then all answer alike.
    """
    path = imagined.path
    stop = path.end[0]
    h = 0
    total = _reward(imagined, h, first)
    while first < stop:
        while h + 1 < len(imagined.plan.weights):
            signal = _split(imagined, h, first)
            h += 1
            _follow(imagined, h, signal)
            play_next(imagined, h, first)
            total += _reward(imagined, h, first)
        first = path.end[h]
        while h > 0 and path.end[h] == first:
            h -= 1
    return total


@inner
def _reward(imagined: Imagined, h: int, first: int) -> float:
    """Sum the weighted rewards of the trajectories at a node for its play."""
    path, weight = imagined.path, float(imagined.plan.weights[h])
    if not imagined.plan.click:
        return weight * float(path.chance[h]) * int(path.end[h] - first)
    likes = 0
    for place in range(first, path.end[h]):
        likes += imagined.draws.answers[h, path.members[place]] < path.chance[h]
    return weight * likes


@inner
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


@inner
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
