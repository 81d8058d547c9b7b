"""The groups of a situation, those that are alike taken together."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner
from policies.situation import Situation


class Groups(NamedTuple):
    """See `Situation`.

    Attributes:
        model: (G,).
        belief: (G, S).
        size: (G,) number of items.
        rested: (G,) slots since their last play.
    """

    model: Ints
    belief: Floats
    size: Ints
    rested: Ints


def groups_of(situation: Situation) -> Groups:
    """Return the groups of a situation."""
    return Groups(situation.model, situation.belief, situation.count, situation.rested)


@compiled
def distinct(groups: Groups, by_rest: bool) -> tuple[Groups, Ints]:
    """Unite groups of the same model and belief, and of the same rest if `by_rest`.

    Returns:
        The groups without repetition, in the order in which they first occur, and the
        (G,) row of each group among them.
    """
    total = len(groups.model)
    row = np.empty(total, dtype=np.int64)
    first = np.empty(total, dtype=np.int64)
    size = np.zeros(total, dtype=np.int64)
    slots = 2
    while slots < 2 * total:
        slots *= 2
    table = np.full(slots, -1)
    bits = groups.belief.view(np.uint64)
    found = 0
    for g in range(total):
        place = _hash(groups.model[g], bits, g) & np.uint64(slots - 1)
        while table[place] >= 0 and not _same(groups, first[table[place]], g, by_rest):
            place = (place + np.uint64(1)) & np.uint64(slots - 1)
        if table[place] < 0:
            table[place] = found
            first[found] = g
            found += 1
        row[g] = table[place]
        size[row[g]] += groups.size[g]
    if found == total:
        return groups, row
    first = first[:found]
    return Groups(
        groups.model[first], groups.belief[first], size[:found], groups.rested[first]
    ), row


@inner
def _hash(model: int, bits: NDArray[np.uint64], g: int) -> np.uint64:
    mixed = np.uint64(model) + np.uint64(0x9E3779B97F4A7C15)
    for i in range(bits.shape[1]):
        mixed = (mixed ^ bits[g, i]) * np.uint64(0xBF58476D1CE4E5B9)
        mixed ^= mixed >> np.uint64(29)
    return mixed


@inner
def _same(groups: Groups, a: int, b: int, by_rest: bool) -> bool:
    if groups.model[a] != groups.model[b]:
        return False
    for i in range(groups.belief.shape[1]):
        if groups.belief[a, i] != groups.belief[b, i]:
            return False
    return not by_rest or groups.rested[a] == groups.rested[b]
