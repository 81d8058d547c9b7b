"""The moods that baselines are told of."""

import numpy as np

from learning.plays import Bools, Plays
from policies import Ints
from policies.mood import Mood

MOOD = Mood()
LAST = Mood(answers=3, levels=())
"""Few moods, for shares that each user has in each."""


def moods(plays: Plays, mood: Mood = MOOD) -> Ints:
    """Return (P,): the class of the user's mood before each play."""
    liked = plays.liked.astype(np.int64)
    return mood.along(plays.first, liked, plays.seconds, plays.slots)


def rested(plays: Plays) -> Bools:
    """Return (P,): whether a play comes after a break, by the clock."""
    after: Bools = moods(plays, LAST) % 2 == 1
    return after
