"""What the items that a trajectory does not touch will be worth, known in advance.

An item that rests moves by P0 alone, so its belief h slots from now is pi P0^h whatever
the answers on other items. A simulated play then costs the few items that were played
in that trajectory, not the candidates (ALGORITHMS.md, section 4.7).
"""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.bayes import like_chance, move
from policies.compiled import compiled, inner
from policies.model_set import ModelSet


class Groups(NamedTuple):
    """The groups of a situation, see `Situation`.

    Attributes:
        model: (G,).
        belief: (G, S).
        size: (G,) number of items.
    """

    model: Ints
    belief: Floats
    size: Ints


class Schedule(NamedTuple):
    """Untouched items in D successive slots.

    Attributes:
        belief: (D * G, S), slot by slot.
        like: (D, G) chance of a like.
        order: (D, min(D, G)) best groups of each slot, best first, ties by row. D
            groups are enough: at most D - 1 can have been used up.
        last: (G,) ordinal after a group's last item; items are numbered through.
    """

    belief: Floats
    like: Floats
    order: Ints
    last: Ints


@compiled
def scheduled(models: ModelSet, groups: Groups, plays: int) -> Schedule:
    """Let all groups rest for the slots of `plays` plays."""
    total = len(groups.model)
    schedule = Schedule(
        np.empty((plays * total, groups.belief.shape[1])),
        np.empty((plays, total)),
        np.empty((plays, min(plays, total)), dtype=np.int64),
        np.cumsum(groups.size),
    )
    for g in range(total):
        for i in range(groups.belief.shape[1]):
            schedule.belief[g, i] = groups.belief[g, i]
    for h in range(plays):
        _fill(models, groups, schedule, h)
        _rank(schedule.like, h, schedule.order)
    return schedule


@inner
def _fill(models: ModelSet, groups: Groups, schedule: Schedule, h: int) -> None:
    """Write beliefs and chances in slot h."""
    total = len(groups.model)
    for g in range(total):
        m, row = groups.model[g], h * total + g
        if h > 0:
            move(models.rest, m, schedule.belief, row - total, schedule.belief, row)
        schedule.like[h, g] = like_chance(models.like, m, schedule.belief, row)


@inner
def _rank(values: Floats, h: int, order: Ints) -> None:
    """Write the columns of the highest values[h] to order[h]; ties by column."""
    ranked = 0
    for g in range(values.shape[1]):
        full = ranked == order.shape[1]
        if full and values[h, g] <= values[h, order[h, ranked - 1]]:
            continue
        place = ranked - 1 if full else ranked
        ranked = place + 1
        while place > 0 and values[h, order[h, place - 1]] < values[h, g]:
            order[h, place] = order[h, place - 1]
            place -= 1
        order[h, place] = g
