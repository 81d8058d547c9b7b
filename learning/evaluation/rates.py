"""Shares of likes so far, shrunk: what a sceptic tries first.

A share is (likes + strength * base) / (answers + strength), the base being the share
of something wider. The strength is that of least log loss on the plays that train, or
on enough of them.
"""

import numpy as np

from learning.evaluation.history import before, faded, tally
from learning.evaluation.metrics import losses
from learning.evaluation.mood import LAST, MOOD, moods
from learning.plays import NONE, Bools, Plays
from policies import Floats, Ints

STRENGTHS = tuple(2.0**power for power in range(-2, 10))
ENOUGH = 1 << 17  # plays that choose a strength
DECAYS = (0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 0.99)

Counts = Floats | Ints


def constant(plays: Plays, train: Bools) -> Floats:
    """Forecast the share of likes among all plays that train."""
    liked = plays.liked[train]
    share = ((liked == 1).sum() + 1) / ((liked != NONE).sum() + 2)
    return np.full(len(plays), share)


def user_rate(plays: Plays, train: Bools) -> Floats:
    """Forecast the user's share of likes, shrunk to everyone's."""
    mine = tally(before(plays), plays.liked)
    base = constant(plays, train)
    return _shrunk(plays, train, mine.likes, mine.answers, base)[0]


def arm_rate(plays: Plays, train: Bools) -> Floats:
    """Forecast the user's share of likes of the arm, shrunk to that of all arms."""
    arm = tally(before(plays, plays.arm, len(plays.arms)), plays.liked)
    base = user_rate(plays, train)
    return _shrunk(plays, train, arm.likes, arm.answers, base)[0]


def moving_rate(plays: Plays, train: Bools) -> Floats:
    """Forecast as `arm_rate`, older answers counting less, by the number since.

    An exponentially weighted moving average; the decay, too, is that of least log loss.
    """
    previous = before(plays, plays.arm, len(plays.arms))
    return _moving(plays, train, previous, user_rate(plays, train))


def recent_rate(plays: Plays, train: Bools) -> Floats:
    """Forecast as `user_rate`, older answers counting less, by the number since."""
    return _moving(plays, train, before(plays), constant(plays, train))


def mood_rate(plays: Plays, train: Bools) -> Floats:
    """Forecast the share of likes in the mood, among all plays that train."""
    known, mood = train & (plays.liked != NONE), moods(plays)
    likes = np.bincount(mood[known], plays.liked[known], MOOD.classes)
    answers = np.bincount(mood[known], minlength=MOOD.classes)
    base = constant(plays, train)
    return _share(likes[mood], answers[mood], base, 1.0)


def rate_in_mood(plays: Plays, train: Bools) -> Floats:
    """Forecast the user's share of likes in the mood, shrunk to that in all moods."""
    mine = tally(before(plays, moods(plays, LAST), LAST.classes), plays.liked)
    base = user_rate(plays, train)
    return _shrunk(plays, train, mine.likes, mine.answers, base)[0]


def arm_rate_in_mood(plays: Plays, train: Bools) -> Floats:
    """Forecast the user's share of likes of the arm in the mood, shrunk as others."""
    kind = plays.arm * LAST.classes + moods(plays, LAST)
    arm = tally(before(plays, kind, len(plays.arms) * LAST.classes), plays.liked)
    base = rate_in_mood(plays, train)
    return _shrunk(plays, train, arm.likes, arm.answers, base)[0]


def _moving(plays: Plays, train: Bools, previous: Ints, base: Floats) -> Floats:
    """Return (P,) shares of the decay that has least loss in training."""
    tried = (
        _shrunk(plays, train, *faded(previous, plays.liked, decay), base)
        for decay in DECAYS
    )
    return min(tried, key=lambda rate: rate[1])[0]


def _shrunk(
    plays: Plays, train: Bools, likes: Counts, answers: Counts, base: Floats
) -> tuple[Floats, float]:
    """Return (P,) shares, shrunk by the best strength, and their loss in training."""
    rows = np.flatnonzero(train & (plays.liked != NONE))
    rows = rows[:: len(rows) // ENOUGH + 1]
    liked = plays.liked[rows]

    def loss(strength: float) -> float:
        chance = _share(likes[rows], answers[rows], base[rows], strength)
        return float(losses(chance, liked).sum())

    best = min(STRENGTHS, key=loss)
    return _share(likes, answers, base, best), loss(best)


def _share(likes: Counts, answers: Counts, base: Floats, strength: float) -> Floats:
    return (likes + strength * base) / (answers + strength)
