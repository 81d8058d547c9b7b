"""The tree of answers under a base policy: every future of some plays.

A base that breaks ties by rule makes one play at each node, and each signal leads to
one child: H plays have K^H futures. The items played on the way to a node are its
touched ones; all others follow the schedule. A level is one play; a slot has M of them.

The mood of a node is known: it follows from the present one and the answers on the way.
Rewards and answers are those of that mood, and so bases rank items, as the policies of
their names do. Leaves are worth what they are in the mean mood.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from policies import grid
from policies.arrays import Floats, Ints
from policies.bayes import IMPOSSIBLE, like_chance, move
from policies.compiled import compiled, inner
from policies.groups import Groups
from policies.index import Index, value_of
from policies.mood import LIKED, MoodState, Rule, class_of, next_state
from policies.moves import Moves, are_moody, lift_of, row_in, tell
from policies.schedule import Schedule, rank_in, scheduled
from policies.situation import Situation

NO_LEAF = 0
ITEM_LEAF = 1
SUM_LEAF = 2
NO_MORE = 2**62
MOODLESS = np.empty(0)
CHOSEN = -1  # the group of an item that the present slot plays in any case
LEVEL = np.dtype(
    [
        ("slot", np.int64),
        ("power", np.float64),  # worth of a reward, beta^slot
        ("touched", np.int64),  # number of touched items
        ("played", np.int64),  # which of them is played
        ("signal", np.int64),  # the answer that is being followed
        ("chance", np.float64),  # of coming here from where the tree is followed from
        ("recent", np.int64),  # see `MoodState`
        ("told", np.int64),
        ("tendency", np.float64),
        ("mood", np.int64),  # the class of it
    ]
)
ITEM = np.dtype(
    [
        ("group", np.int64),
        ("model", np.int64),
        ("number", np.int64),  # which item it is, where the base plays at random
    ]
)


class Now(NamedTuple):
    """What the present slot plays beside the candidate.

    Attributes:
        plays: M; of more than there are items, all are played.
        model: (C,) of the items chosen already.
        belief: (C, S) of them.
        mood: (4,) of the user, as `MoodState` has it, and whether the candidate is
            played after a pause; (0,) where models have none.
    """

    plays: int
    model: Ints
    belief: Floats
    mood: Floats


def now_of(situation: Situation) -> Now:
    """Return what the slot of a situation plays."""
    slate = situation.slate
    mood = MOODLESS
    if situation.models.classes > 1:
        mood = np.array((*situation.mood, situation.resumed), dtype=np.float64)
    return Now(slate.plays, slate.model, slate.belief, mood)


class Tree(NamedTuple):
    """The path that is being followed, and what following it needs.

    Levels h run from 0, the candidate's play, to T; at most Q items are touched.

    Attributes:
        moves: of the models.
        scores: the scores by which B bases play, then what an item is worth at a leaf.
        bases: B.
        leaf: what is earned at level T. NO_LEAF; ITEM_LEAF: the worth of the item that
            the base would play; SUM_LEAF: the worths of all items, added up.
        constant: (1,) added to that sum.
        group: (G,) model of each group.
        size: (G,) its items.
        schedule: of the groups.
        corners: scratch.
        level: (T + 1,) of LEVEL.
        item: (Q,) of ITEM, the touched ones.
        since: ((T + 1) Q,) the slot in which they were last played, level by level.
        belief: ((T + 1) Q, S) of them.
        lowest: (B, T + 1, C) the lowest score with which an item was played in a mood.
        used: (B, G) how many items of a group were touched on one path.
    """

    moves: Moves
    scores: Index
    bases: int
    leaf: int
    constant: Floats
    group: Ints
    size: Ints
    schedule: Schedule
    corners: grid.Corners
    level: NDArray[np.void]
    item: NDArray[np.void]
    since: Ints
    belief: Floats
    lowest: Floats
    used: Ints


@compiled
def planted(
    moves: Moves,
    groups: Groups,
    index: Index,
    leaf: int,
    now: Now,
    levels: int,
    discount: float,
) -> Tree:
    """Make room for a tree of some levels; the chosen items have moved unanswered."""
    chosen, states, bases = len(now.model), groups.belief.shape[1], len(index.place) - 1
    plays = min(now.plays, groups.size.sum() + chosen)
    slots, room = (chosen + levels) // plays + 1, chosen + levels + 1
    level = np.zeros(levels + 1, dtype=LEVEL)
    for h in range(levels + 1):
        level[h].slot = (chosen + h) // plays
        level[h].power = discount ** level[h].slot
        level[h].touched = chosen
    if are_moody(moves):
        mood = MoodState(int(now.mood[0]), int(now.mood[1]), now.mood[2])
        _enter(moves.rule, level, 0, mood, now.mood[3] > 0.0)
    item = np.zeros(room, dtype=ITEM)
    belief = np.zeros(((levels + 1) * room, states))
    for k in range(chosen):
        m = now.model[k]
        item[k].group, item[k].model = CHOSEN, m
        chances = row_in(moves, m, 0)
        for signal in range(moves.signals[m]):
            for i in range(states):
                belief[k] += now.belief[k, i] * moves.told[chances, signal, i]
    return Tree(
        moves,
        index,
        bases,
        leaf,
        np.zeros(1),
        groups.model,
        groups.size,
        scheduled(moves, groups, index, bases, slots, levels + 1, level[0].mood),
        grid.corners(states),
        level,
        item,
        np.zeros((levels + 1) * room, dtype=np.int64),
        belief,
        np.full((bases, levels + 1, moves.classes), np.inf),
        np.zeros((bases, len(groups.model)), dtype=np.int64),
    )


@compiled
def sum_at_rest(tree: Tree) -> float:
    """Return the worths of all candidates at level T, had they only rested."""
    total, end = 0.0, len(tree.level) - 1
    for g in range(len(tree.group)):
        total += tree.size[g] * _worth_at_rest(tree, end, g)
    return total


@inner
def excess(tree: Tree, h: int, k: int) -> float:
    """Return by how much a touched item is worth more, at level h, than at rest."""
    at, m, g = h * len(tree.item) + k, tree.item[k].model, tree.item[k].group
    worth = value_of(tree.scores, tree.bases, m, tree.belief, at, 0.0, tree.corners)
    return worth if g == CHOSEN else worth - _worth_at_rest(tree, h, g)


@inner
def _worth_at_rest(tree: Tree, h: int, g: int) -> float:
    row = tree.level[h].slot * len(tree.group) + g
    return value_of(
        tree.scores,
        tree.bases,
        tree.group[g],
        tree.schedule.belief,
        row,
        0.0,
        tree.corners,
    )


@inner
def left(tree: Tree, h: int, g: int) -> int:
    """Return how many items of group g are untouched at level h."""
    items = tree.size[g]
    for k in range(tree.level[h].touched):
        items -= tree.item[k].group == g
    return int(items)


@inner
def touch(tree: Tree, h: int, g: int) -> None:
    """Play an item of group g at level h that was not played before it."""
    k = tree.level[h].touched
    tree.level[h].touched = k + 1
    tree.level[h].played = k
    tree.item[k].group = g
    tree.item[k].model = tree.group[g]
    row = tree.level[h].slot * len(tree.group) + g
    for i in range(tree.belief.shape[1]):
        tree.belief[h * len(tree.item) + k, i] = tree.schedule.belief[row, i]


@inner
def pass_slot(tree: Tree, h: int) -> None:
    """Move all touched items but the played one on to level h + 1."""
    room, slot = len(tree.item), tree.level[h].slot
    ends = tree.level[h + 1].slot > slot
    tree.level[h + 1].touched = tree.level[h].touched
    for k in range(tree.level[h].touched):
        at = h * room + k
        played = k == tree.level[h].played
        tree.since[at + room] = slot if played else tree.since[at]
        if played:
            continue
        if ends and tree.since[at] != slot:
            m = tree.item[k].model
            move(tree.moves.rest, m, tree.belief, at, tree.belief, at + room)
        else:
            for i in range(tree.belief.shape[1]):
                tree.belief[at + room, i] = tree.belief[at, i]


@inner
def answer(tree: Tree, h: int, signal: int) -> float:
    """Move the item played at level h on by a signal; return the chance of that.

    The mood moves, too.
    """
    room, k = len(tree.item), tree.level[h].played
    at, m = h * room + k, tree.item[k].model
    chances = chances_of(tree, h, m)
    if are_moody(tree.moves):
        feel(tree.moves.rule, tree.level, h, liked(tree, m, signal))
    return tell(tree.moves, chances, signal, tree.belief, at, tree.belief, at + room)


@inner
def chances_of(tree: Tree, h: int, m: int) -> int:
    """Return the row of model m's chances in the mood of level h."""
    return int(row_in(tree.moves, m, tree.level[h].mood))


@inner
def reward_of(tree: Tree, h: int) -> float:
    """Return the expected reward of what is played at level h."""
    k = tree.level[h].played
    at, chances = h * len(tree.item) + k, chances_of(tree, h, tree.item[k].model)
    return like_chance(tree.moves.like, chances, tree.belief, at)


@inner
def liked(tree: Tree, m: int, signal: int) -> int:
    """Return 1 if a signal of model m is a like, else 0."""
    return int(tree.moves.reward[m, signal] >= LIKED)


@inner
def feel(rule: Rule, level: NDArray[np.void], h: int, liked: int) -> None:
    """Let the mood of level h + 1 follow from an answer at level h.

    Imagined plays follow each other at once, without a pause.
    """
    before = MoodState(level[h].recent, level[h].told, level[h].tendency)
    _enter(rule, level, h + 1, next_state(rule, before, liked), False)


@inner
def _enter(
    rule: Rule, level: NDArray[np.void], h: int, state: MoodState, resumed: bool
) -> None:
    level[h].recent, level[h].told = state.recent, state.told
    level[h].tendency = state.tendency
    level[h].mood = class_of(rule, state, resumed)


@inner
def play_base(tree: Tree, b: int, h: int) -> float:
    """Let base b play at level h; return the score of what it plays.

    Ties: the lowest group, untouched before touched, the first touched.
    """
    slot, mood = tree.level[h].slot, tree.level[h].mood
    ranked = row_in(tree.moves, b * tree.schedule.slots + slot, mood)
    if are_moody(tree.moves) and tree.schedule.order[ranked, 0] < 0:
        rank_in(tree.moves, tree.schedule, tree.group, tree.scores, ranked)
    row, best, score = len(tree.group), -1, -np.inf
    for rank in range(tree.schedule.order.shape[1]):
        g = tree.schedule.order[ranked, rank]
        if left(tree, h, g) > 0:
            row, score = g, tree.schedule.score[ranked, g]
            break
    for k in range(tree.level[h].touched):
        at, m = h * len(tree.item) + k, tree.item[k].model
        if tree.since[at] == slot and h > 0:
            continue
        rested = float(slot - tree.since[at] - 1)
        value = score_of(tree, b, m, at, rested, mood)
        if value > score or (value == score and tree.item[k].group < row):
            row, best, score = tree.item[k].group, k, value
    if best < 0:
        touch(tree, h, row)
    else:
        tree.level[h].played = best
    return score


@inner
def score_of(tree: Tree, b: int, m: int, at: int, rested: float, mood: int) -> float:
    """Return the score that base b gives a touched item in a mood."""
    value = value_of(tree.scores, b, m, tree.belief, at, rested, tree.corners)
    if are_moody(tree.moves) and tree.scores.place[b, m].lifts == 1:
        value += lift_of(tree.moves, m, mood, tree.belief, at)
    return value


@compiled
def follow(tree: Tree, b: int, start: int) -> float:
    """Return what base b earns from level `start` on, leaf included.

    Writes down with which scores at least, and from which groups, it played.
    """
    before = tree.level[start].touched
    tree.level[start].chance = 1.0
    total, h, arriving = 0.0, start, True
    while h >= start:
        if arriving:
            tree.level[h].touched = before if h == start else tree.level[h - 1].touched
            total += tree.level[h].chance * tree.level[h].power * _visit(tree, b, h)
        arriving = _descend(tree, h)
        h += 1 if arriving else -1
    tree.level[start].touched = before
    return total


@inner
def _visit(tree: Tree, b: int, h: int) -> float:
    """Let the base play at a node, or value the leaf; return what it earns."""
    end = len(tree.level) - 1
    tree.level[h].signal = NO_MORE
    if h == end and tree.leaf == SUM_LEAF:
        total = float(tree.constant[0])
        for k in range(tree.level[h].touched):
            total += excess(tree, h, k)
        return total
    score = play_base(tree, b, h)
    mood = tree.level[h].mood
    tree.lowest[b, h, mood] = min(tree.lowest[b, h, mood], score)
    k = tree.level[h].played
    at, m, g = h * len(tree.item) + k, tree.item[k].model, tree.item[k].group
    if g != CHOSEN:
        tree.used[b, g] = max(tree.used[b, g], tree.size[g] - left(tree, h, g))
    if h == end:
        return value_of(tree.scores, tree.bases, m, tree.belief, at, 0.0, tree.corners)
    if h + 1 < end or tree.leaf != NO_LEAF:
        pass_slot(tree, h)
        tree.level[h].signal = -1
    return reward_of(tree, h)


@inner
def _descend(tree: Tree, h: int) -> bool:
    """Follow the next signal that is possible at level h; say whether there is one."""
    signals = tree.moves.signals[tree.item[tree.level[h].played].model]
    while tree.level[h].signal + 1 < signals:
        tree.level[h].signal += 1
        chance = answer(tree, h, tree.level[h].signal)
        if chance >= IMPOSSIBLE:
            tree.level[h + 1].chance = tree.level[h].chance * chance
            return True
    return False
