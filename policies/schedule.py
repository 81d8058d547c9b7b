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
from policies.moves import Moves


class Schedule(NamedTuple):
    """G groups at rest in T successive slots, and how B bases rank them.

    Attributes:
        belief: (T * G, S), slot by slot.
        reward: (G,) expected in the first slot, in the mood of the next play.
        score: (B * T, G), base by base.
        order: (B * T, R) the R best groups, best first, ties by row.
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

    They are ranked as they are in their mean mood.
    """
    total, states = len(groups.model), groups.belief.shape[1]
    schedule = Schedule(
        np.empty((slots * total, states)),
        np.empty(total),
        np.empty((bases * slots, total)),
        np.empty((bases * slots, min(places, total)), dtype=np.int64),
        slots,
    )
    corners = grid.corners(states)
    for g in range(total):
        for i in range(states):
            schedule.belief[g, i] = groups.belief[g, i]
        chances = groups.model[g] * moves.classes + mood
        schedule.reward[g] = like_chance(moves.like, chances, schedule.belief, g)
    for slot in range(slots):
        for g in range(total):
            m, row = groups.model[g], slot * total + g
            if slot > 0:
                move(moves.rest, m, schedule.belief, row - total, schedule.belief, row)
            rested = float(groups.rested[g] + slot)
            for b in range(bases):
                schedule.score[b * slots + slot, g] = value_of(
                    index, b, m, schedule.belief, row, rested, corners
                )
        for b in range(bases):
            _rank(schedule.score, b * slots + slot, schedule.order)
    return schedule


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
