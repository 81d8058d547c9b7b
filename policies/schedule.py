"""What the items that nobody plays will be worth, known in advance.

An item that rests moves by P0 alone, so its belief h slots from now is pi P0^h whatever
the answers on other items. An imagined play then costs the few items that were played
on the way to it, not the candidates.
"""

from typing import NamedTuple

import numpy as np

from policies import grid
from policies.arrays import Floats, Ints
from policies.bayes import like_chance, move
from policies.compiled import compiled, inner
from policies.groups import Groups
from policies.index import Index, value_of
from policies.moves import Moves, are_moody, lift_of, row_in


class Schedule(NamedTuple):
    """G groups at rest in T successive slots, and how B bases rank them.

    Attributes:
        belief: (T * G, S), slot by slot.
        reward: (G,) expected in the first slot, in the mood of the next play.
        score: (B * T * C, G), base by base, slot by slot, mood by mood. Where C is not
            1, rows of the mean mood follow, (B * T, G), and only those are known first.
        order: (B * T * C, R) the R best groups, best first, ties by row; -1 if it is
            not known.
        slots: T.
    """

    belief: Floats
    reward: Floats
    score: Floats
    order: Ints
    slots: int


@compiled
def scheduled(
    moves: Moves,
    groups: Groups,
    index: Index,
    bases: int,
    slots: int,
    places: int,
    mood: int,
) -> Schedule:
    """Let all groups rest for some slots, and rank as many places as may be needed.

    Where there are moods, they are ranked once one is met, by `rank_in`.
    """
    total, states = len(groups.model), groups.belief.shape[1]
    rows, means = bases * slots * moves.classes, bases * slots
    schedule = Schedule(
        np.empty((slots * total, states)),
        np.empty(total),
        np.empty((rows + means if are_moody(moves) else rows, total)),
        np.full((rows, min(places, total)), -1),
        slots,
    )
    first = rows if are_moody(moves) else 0
    corners = grid.corners(states)
    for g in range(total):
        for i in range(states):
            schedule.belief[g, i] = groups.belief[g, i]
        chances = row_in(moves, groups.model[g], mood)
        schedule.reward[g] = like_chance(moves.like, chances, schedule.belief, g)
    for slot in range(slots):
        for g in range(total):
            m, row = groups.model[g], slot * total + g
            if slot > 0:
                move(moves.rest, m, schedule.belief, row - total, schedule.belief, row)
            rested = float(groups.rested[g] + slot)
            for b in range(bases):
                schedule.score[first + b * slots + slot, g] = value_of(
                    index, b, m, schedule.belief, row, rested, corners
                )
        for b in range(0 if are_moody(moves) else bases):
            _rank(schedule.score, b * slots + slot, schedule.order)
    return schedule


@compiled
def rank_in(
    moves: Moves, schedule: Schedule, model: Ints, index: Index, row: int
) -> None:
    """Rank the groups (G,) of models as a base does in a slot and a mood.

    Args:
        moves: of the models.
        schedule: filled in.
        model: (G,) model of each group.
        index: by which bases play.
        row: of the base, the slot and the mood, among the orders.
    """
    mean, mood = row // moves.classes, row % moves.classes
    b, slot = mean // schedule.slots, mean % schedule.slots
    total, means = len(model), len(schedule.order)
    for g in range(total):
        value, belief = schedule.score[means + mean, g], slot * total + g
        if index.place[b, model[g]].lifts == 1:
            value += lift_of(moves, model[g], mood, schedule.belief, belief)
        schedule.score[row, g] = value
    _rank(schedule.score, row, schedule.order)


@inner
def _rank(values: Floats, row: int, order: Ints) -> None:
    """Write the columns of the highest values[row] to order[row]; ties by column."""
    ranked = 0
    for g in range(values.shape[1]):
        full = ranked == order.shape[1]
        if full and values[row, g] <= values[row, order[row, ranked - 1]]:
            continue
        place = ranked - 1 if full else ranked
        ranked = place + 1
        while place > 0 and values[row, order[row, place - 1]] < values[row, g]:
            order[row, place] = order[row, place - 1]
            place -= 1
        order[row, place] = g
