"""What regression and boosting are told of each play."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from learning.evaluation.forecaster import logit
from learning.evaluation.history import before, tally
from learning.evaluation.mood import rested
from learning.evaluation.rates import (
    arm_rate,
    arm_rate_in_mood,
    mood_rate,
    moving_rate,
    rate_in_mood,
    recent_rate,
    user_rate,
)
from learning.plays import Bools, Plays
from policies import Floats

Features = NDArray[np.float32]

ARM_BACK = 3  # latest answers to the arm that are told
BACK = 3  # latest answers to anything that are told


def features(plays: Plays, train: Bools, *, mood: bool) -> Features:
    """Return (P, F): the log odds of shares of likes so far, the last answers, gaps.

    Of the arm: the shrunk share, the same with older answers counting less, answers so
    far, the last three, slots and seconds since. Of the user: the shrunk share; with
    `mood` the last three answers to anything, the share of the last ten and of all with
    older ones counting less, whether there was a break, and the shares in the mood of
    everyone, of the user, and of the user on the arm.

    Args:
        plays: P plays.
        train: (P,) those that shares are shrunk by.
        mood: whether what was answered on other arms, lately, is told.
    """
    columns = [*_of_the_arm(plays, train), *(_of_late(plays, train) if mood else ())]
    return np.stack([column.astype(np.float32) for column in columns], axis=1)


def _of_the_arm(plays: Plays, train: Bools) -> Iterator[Floats]:
    for rate in (user_rate, arm_rate, moving_rate):
        yield logit(rate(plays, train))
    previous = before(plays, plays.arm, len(plays.arms))
    arm = tally(previous, plays.liked)
    yield np.log1p(arm.answers)
    for back in range(ARM_BACK):
        yield arm.latest(back)
    gap = plays.slot - plays.slot[previous]
    yield np.where(previous < 0, 0.0, np.log1p(np.maximum(gap, 0)))
    if plays.seconds is not None:
        seconds = plays.seconds - plays.seconds[previous]
        yield np.where(previous < 0, 0.0, np.log1p(np.maximum(seconds, 0)))


def _of_late(plays: Plays, train: Bools) -> Iterator[Floats | Bools]:
    latest = tally(before(plays), plays.liked)
    for back in range(BACK):
        yield latest.latest(back)
    likes, answers = latest.latest_likes()
    yield logit((likes + 0.5) / (answers + 1))
    yield rested(plays)
    for rate in (recent_rate, mood_rate, rate_in_mood, arm_rate_in_mood):
        yield logit(rate(plays, train))
