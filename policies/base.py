"""What the base policy of a rollout plays next in a trajectory, compiled."""

from policies.arrays import Ints
from policies.bayes import like_chance
from policies.compiled import inner
from policies.path import Imagined, touch


@inner
def play_next(imagined: Imagined, h: int, first: int) -> None:
    """Let the base play at depth h."""
    if len(imagined.draws.items) == 0:
        _play_best(imagined, h)
    else:
        _play_item(imagined, h, imagined.draws.items[h, imagined.path.members[first]])


@inner
def _play_item(imagined: Imagined, h: int, item: int) -> None:
    path = imagined.path
    for k in range(path.touched[h]):
        if path.item[k] == item:
            m = imagined.groups.model[path.group[k]]
            path.played[h] = k
            row = h * len(path.end) + k
            path.chance[h] = like_chance(imagined.models.like, m, path.belief, row)
            return
    touch(imagined, h, _group_of(imagined.schedule.last, item), item)


@inner
def _group_of(last: Ints, item: int) -> int:
    """Search the group of an item: the first row of `last` above its ordinal."""
    low, high = 0, len(last) - 1
    while low < high:
        middle = (low + high) // 2
        if last[middle] > item:
            high = middle
        else:
            low = middle + 1
    return low


@inner
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
        touch(imagined, h, row, -1)
    else:
        path.played[h] = best
        path.chance[h] = chance


@inner
def _best_untouched(imagined: Imagined, h: int) -> int:
    """Return the best group at depth h that has an untouched item left, or -1."""
    path = imagined.path
    for rank in range(imagined.schedule.order.shape[1]):
        g = imagined.schedule.order[h, rank]
        left = imagined.groups.size[g]
        for k in range(path.touched[h]):
            left -= path.group[k] == g
        if left > 0:
            return int(g)
    return -1
