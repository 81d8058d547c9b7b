"""The user's mood: a small class of the last answers, whatever items they were for.

What a user just liked or skipped tells of the next play of any item. A mood is known,
not hidden: like chances are given by state and mood, and since each answer leads to one
next mood, plans know it at every node of the tree of answers.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from policies.arrays import Floats, Ints, as_floats, as_ints
from policies.compiled import compiled, inner

Bools: TypeAlias = NDArray[np.bool_]

MOST_ANSWERS = 4
MOST_LEVELS = 16
LIKED = 0.5  # a signal worth this much is a like
NONE = -1


class MoodState(NamedTuple):
    """What a user's mood follows from.

    Attributes:
        recent: the last answers in binary after a leading one, the last of them last.
        told: answers so far.
        tendency: share of likes among them, the later ones counting more.
    """

    recent: int = 1
    told: int = 0
    tendency: float = 0.5


NEUTRAL = MoodState()


# How answers make a mood, as compiled code takes it, quickly: one array. The answers
# told apart, the least weight of one in the tendency, the seconds after which a play
# has a mood of its own (0: none has), and the levels.
Rule: TypeAlias = Floats
ANSWERS, WEIGHT, PAUSES, LEVELS = 0, 1, 2, 3


@inner
def class_of(rule: Rule, state: MoodState, resumed: bool) -> int:
    """Return the class of a mood; see `Mood.of`."""
    levels, level = len(rule) - LEVELS, 0
    while level < levels and state.tendency >= rule[LEVELS + level]:
        level += 1
    found = (state.recent - 1) * (levels + 1) + level
    return found * 2 + int(resumed) if rule[PAUSES] > 0.0 else found


@inner
def next_state(rule: Rule, state: MoodState, liked: int) -> MoodState:
    """Return what follows an answer; see `Mood.after`."""
    if liked < 0:
        return state
    most, recent = 1 << int(rule[ANSWERS]), state.recent * 2 + liked
    if recent >= 2 * most:  # the earliest answer is forgotten
        recent = recent % most + most
    # At first, one answer half liked.
    step = max(1.0 / (state.told + 2.0), rule[WEIGHT])
    tendency = state.tendency + step * (liked - state.tendency)
    return MoodState(recent, state.told + 1, tendency)


def paused(rule: Rule, waited_s: float | None) -> bool:
    """Return whether a play has the mood that follows a pause; see `Mood.of`."""
    return waited_s is not None and bool(0.0 < rule[PAUSES] < waited_s)


@dataclass(frozen=True, slots=True)
class Mood:
    """How answers make a mood.

    Attributes:
        answers: how many of the last answers are told apart, 0 to 4.
        memory: answers that the tendency goes back over, at least 1; None: all, alike.
        levels: (L,) bounds between classes of the tendency, ascending, in (0, 1).
        pause_s: seconds without a play after which a play finds a mood of its own; or
            None.
    """

    answers: int = 2
    memory: float | None = 10.0
    levels: tuple[float, ...] = (0.1, 0.25, 0.4, 0.55, 0.7, 0.82, 0.92)
    pause_s: float | None = 1800.0

    def __post_init__(self) -> None:
        """Check.

        Raises:
            ValueError: names the field.
        """
        object.__setattr__(self, "levels", tuple(map(float, self.levels)))
        if not 0 <= self.answers <= MOST_ANSWERS:
            raise ValueError(f"answers: must be from 0 to {MOST_ANSWERS}")
        if self.memory is not None and not 1 <= self.memory < np.inf:
            raise ValueError("memory: must be a number from 1, or null for all answers")
        if len(self.levels) > MOST_LEVELS:
            raise ValueError(f"levels: there may be {MOST_LEVELS}")
        if not all(0 < level < 1 for level in self.levels):
            raise ValueError("levels: must lie between 0 and 1")
        if any(after <= before for before, after in pairwise(self.levels)):
            raise ValueError("levels: must ascend")
        if self.pause_s is not None and not 0 < self.pause_s < np.inf:
            raise ValueError("pause_s: must be a positive number of seconds, or null")

    @property
    def classes(self) -> int:
        """Return C, how many moods there are."""
        pauses = 1 if self.pause_s is None else 2
        return ((2 << self.answers) - 1) * (len(self.levels) + 1) * pauses

    def of(self, state: MoodState, waited_s: float | None) -> int:
        """Return the class of a mood, 0 to C - 1.

        Args:
            state: what it follows from.
            waited_s: seconds since the last play; None: it is the first, or nobody
                knows.
        """
        return class_of(self.rule, state, paused(self.rule, waited_s))

    def after(self, state: MoodState, liked: int) -> MoodState:
        """Return what follows an answer: 1 a like, 0 another, NONE none."""
        return MoodState(*next_state(self.rule, state, liked))

    def along(
        self,
        first: Ints,
        liked: Ints,
        seconds: Floats | None,
        slots: Ints | None = None,
    ) -> Ints:
        """Return (P,): the class of the mood before each play of a log.

        The plays of a slot are all in the mood in which it begins, and a pause is one
        between the beginnings of two slots.

        Args:
            first: (U + 1,) where each user's plays begin.
            liked: (P,) 1, 0 or NONE.
            seconds: (P,) when plays began; None: not known.
            slots: (P,) in which they were; None: each in one of its own.
        """
        known, bounds = as_ints(liked), as_ints(first)
        slot = np.arange(len(known)) if slots is None else as_ints(slots)
        resumed = np.zeros(len(known), dtype=np.bool_)
        if seconds is not None and self.pause_s is not None:
            resumed = _resumed(bounds, slot, seconds, self.pause_s)
        return _along(self.rule, bounds, known, slot, resumed)

    @property
    def rule(self) -> Rule:
        """Return what compiled code needs of it."""
        weight = 0.0 if self.memory is None else 1.0 / self.memory
        return as_floats((self.answers, weight, self.pause_s or 0.0, *self.levels))


NO_RULE = Mood(answers=0, memory=None, levels=(), pause_s=None).rule


def _resumed(first: Ints, slot: Ints, seconds: Floats, pause_s: float) -> Bools:
    """Return (P,): whether a play is the first of a slot that comes after a pause."""
    user = np.repeat(np.arange(len(first) - 1), np.diff(first))
    fresh = np.ones(len(slot), dtype=np.bool_)
    fresh[1:] = (slot[1:] != slot[:-1]) | (user[1:] != user[:-1])
    begun = np.flatnonzero(fresh)
    again = user[begun[1:]] == user[begun[:-1]]
    resumed = np.zeros(len(slot), dtype=np.bool_)
    resumed[begun[1:]] = again & (np.diff(seconds[begun]) > pause_s)
    return resumed


@compiled
def _along(rule: Rule, first: Ints, liked: Ints, slots: Ints, resumed: Bools) -> Ints:
    found = np.empty(len(liked), dtype=np.int64)
    for u in range(len(first) - 1):
        _follow(rule, first[u], first[u + 1], liked, slots, resumed, found)
    return found


@compiled
def course(
    rule: Rule, liked: Ints, slots: Ints, resumed: Bools
) -> tuple[Ints, MoodState]:
    """See `ModelSet.mood_course`."""
    found = np.empty(len(liked), dtype=np.int64)
    return found, _follow(rule, 0, len(liked), liked, slots, resumed, found)


@inner
def _follow(
    rule: Rule,
    first: int,
    after: int,
    liked: Ints,
    slots: Ints,
    resumed: Bools,
    found: Ints,
) -> MoodState:
    """Write the moods of one user's plays; return what the last slot began with."""
    state, begun = MoodState(1, 0, 0.5), first
    before = state
    for p in range(first, after):
        if p == first or slots[p] != slots[begun]:
            before, begun = state, p
            found[p] = class_of(rule, state, resumed[p])
        found[p] = found[begun]
        state = next_state(rule, state, liked[p])
    return before
