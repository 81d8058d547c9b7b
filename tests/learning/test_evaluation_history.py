"""What lay before each play, against loops over the plays."""

from collections.abc import Sequence

import numpy as np
from hypothesis import given
from numpy.testing import assert_allclose

from learning import NONE, Plays
from learning.evaluation.history import LATEST, before, faded, tally
from learning.evaluation.mood import rested
from tests.learning.logs import log, logs

DECAY = 0.7


def answers_before(plays: Plays, row: int, arm: int | None = None) -> Sequence[int]:
    """Answers that the user gave before a play, if told to that arm, in order."""
    return [
        int(plays.liked[p])
        for p in range(row)
        if plays.user[p] == plays.user[row]
        and arm in {None, plays.arm[p]}
        and plays.liked[p] != NONE
    ]


@given(logs(most=20))
def test_a_play_follows_the_users_last_of_the_arm(plays: Plays) -> None:
    previous = before(plays, plays.arm, len(plays.arms))

    for row, found in enumerate(previous):
        same = (plays.user[:row] == plays.user[row]) & (
            plays.arm[:row] == plays.arm[row]
        )
        assert found == max(np.flatnonzero(same), default=-1)


@given(logs(most=40, users=2, arms=2))
def test_a_tally_counts_the_answers_before(plays: Plays) -> None:
    anything = tally(before(plays), plays.liked)
    arm = tally(before(plays, plays.arm, len(plays.arms)), plays.liked)

    for row in range(len(plays)):
        for found, of in ((anything, None), (arm, int(plays.arm[row]))):
            told = answers_before(plays, row, of)
            signs = [2 * answer - 1 for answer in told[: -LATEST - 1 : -1]]
            assert found.answers[row] == len(told)
            assert found.likes[row] == sum(told)
            assert found.latest_likes()[0][row] == sum(told[-LATEST:])
            assert found.latest_likes()[1][row] == len(told[-LATEST:])
            for back, sign in enumerate((signs + [0] * LATEST)[:LATEST]):
                assert found.latest(back)[row] == sign


@given(logs(most=20))
def test_older_answers_fade(plays: Plays) -> None:
    likes, answers = faded(before(plays), plays.liked, DECAY)

    for row in range(len(plays)):
        told = answers_before(plays, row)
        worth = DECAY ** np.arange(len(told))[::-1]
        assert_allclose(likes[row], worth @ told, atol=1e-12)
        assert_allclose(answers[row], worth.sum(), atol=1e-12)


@given(logs(most=20))
def test_a_user_is_rested_after_half_an_hour(plays: Plays) -> None:
    seconds = np.zeros(len(plays)) if plays.seconds is None else plays.seconds

    for row, found in enumerate(rested(plays)):
        same = row > 0 and plays.user[row] == plays.user[row - 1]
        assert found == (same and seconds[row] - seconds[row - 1] > 1800)


def test_nobody_is_rested_where_only_the_order_is_known() -> None:
    assert not rested(log([0, 0, 1], [0, 0, 0], [1, 1, 0])).any()
