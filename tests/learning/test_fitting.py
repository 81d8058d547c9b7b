"""Models of a log, and what they foretell."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from learning import NONE, Plays
from learning.chain import Chain
from learning.em import Effort
from learning.evaluation import BASELINES, evaluate
from learning.fitting import ChainForecaster, Recipe, expected, fit
from policies.mood import Mood
from tests.learning.logs import log, sampled

QUICK = Effort(starts=2, steps=40)
TIRING = Chain(
    np.array([[0.95, 0.05], [0.8, 0.2]]),
    np.array([[0.5, 0.5], [0.02, 0.98]]),
    np.array([[[0.95, 0.05], [0.1, 0.9]]]),
    np.array([0.1, 0.9]),
)


@pytest.fixture(scope="module")
def plays() -> Plays:
    return sampled([TIRING], np.random.default_rng(1), 60, 80, 4)


def test_a_chain_foretells_what_moves_better_than_what_stands_still(
    plays: Plays,
) -> None:
    chain = ChainForecaster(Recipe(states=2, effort=QUICK))
    names = ("constant", "user-arm rate", "user-arm moving average")

    found = evaluate(
        plays, {"chain": chain} | {name: BASELINES[name] for name in names}
    )

    first, *others = found.scores
    assert all(other.difference_ci95[0] > 0.05 for other in others)
    assert first.by_count.error < 0.06  # of 96 plays a bin


def test_no_play_is_foretold_from_itself_or_from_later_ones(plays: Plays) -> None:
    fitted = fit(plays, Recipe(states=2, mood=Mood(), effort=QUICK))
    before = expected(plays, fitted)
    user, at = 7, 40
    row = int(plays.first[user]) + at
    plays.answer[row] = 1 - plays.answer[row]

    after = expected(plays, fitted)

    plays.answer[row] = 1 - plays.answer[row]
    changed = np.flatnonzero((before != after).any(axis=1))
    assert changed.min() > row
    assert (plays.user[changed] == user).all()


def test_what_is_learned_does_not_see_the_plays_to_score(plays: Plays) -> None:
    train = plays.earliest(0.7)
    forecaster = ChainForecaster(Recipe(states=2, effort=QUICK))
    alone = fit(plays.of(train), Recipe(states=2, effort=QUICK))

    found = forecaster(plays, train)

    assert_array_equal(found, expected(plays, alone)[:, 1])


def test_moods_are_learned_where_they_tell() -> None:
    """Likes follow likes, of any arm: a mood tells, a chain of an arm does not."""
    rng = np.random.default_rng(4)
    answer = np.empty((80, 60), dtype=np.int64)
    answer[:, 0] = rng.integers(0, 2, 80)
    for slot in range(1, 60):
        same = rng.random(80) < 0.85
        answer[:, slot] = np.where(same, answer[:, slot - 1], 1 - answer[:, slot - 1])
    arm = rng.integers(0, 40, (80, 60))
    users = np.repeat(np.arange(80), 60)
    told = log(users.tolist(), arm.ravel().tolist(), answer.ravel().tolist())
    recipe = Recipe(states=2, effort=QUICK)
    moody = Recipe(states=2, mood=Mood(1, None, (), None), effort=QUICK)

    found = evaluate(
        told,
        {"mood": ChainForecaster(moody), "chain": ChainForecaster(recipe)},
        repeats=False,
    )

    with_mood, without = found.scores
    least = -(0.85 * np.log(0.85) + 0.15 * np.log(0.15))
    assert with_mood.log_loss == pytest.approx(least, abs=0.03)
    assert without.log_loss > 0.6
    fitted = fit(told, moody)
    assert fitted.whole.chain.observe.shape == (3, 2, 2)
    assert_allclose(fitted.shares.sum(), 1.0)
    assert fitted.shares[0] == pytest.approx(80 / 4800, rel=0.01)


def test_each_arm_is_foretold_by_its_type() -> None:
    still = Chain(np.eye(2), np.eye(2), TIRING.observe, np.array([0.5, 0.5]))
    mixed = sampled([TIRING, still], np.random.default_rng(5), 60, 80, 6)
    recipe = Recipe(states=2, types=2, effort=QUICK)

    with ThreadPoolExecutor(2) as pool:
        fitted = fit(mixed, recipe, pool.map)
    found = expected(mixed, fitted)

    alone, pooled = (
        evaluate(mixed, {"chain": ChainForecaster(each)}).scores[0].log_loss
        for each in (recipe, Recipe(states=2, effort=QUICK))
    )
    assert alone < pooled
    assert_allclose(found.sum(axis=1), 1.0)


def test_rests_by_the_clock_are_learned_from_times(plays: Plays) -> None:
    answered = log([0, 0, 0], [0, 1, 0], [1, 0, 1], [0.0, 60.0, 7200.0])

    fitted = fit(answered, Recipe(states=2, in_time=True, effort=QUICK))

    assert_allclose(fitted.whole.chain.rest.sum(axis=1), 0.0, atol=1e-12)
    with pytest.raises(ValueError, match="time of each play"):
        fit(plays, Recipe(in_time=True))


def test_nothing_is_learned_from_nothing() -> None:
    with pytest.raises(ValueError, match="no play of the log was answered"):
        fit(log([0, 0], [0, 1], [NONE, NONE]), Recipe())
