"""What a sceptic would try: fair, and no fool."""

import importlib
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from learning import NONE, Plays
from learning.evaluation import BASELINES, BOOSTED, Forecaster
from learning.evaluation.history import before, tally
from learning.evaluation.logistic import RIDGE, fitted
from learning.evaluation.metrics import losses
from learning.evaluation.rates import STRENGTHS, arm_rate, user_rate
from learning.plays import Bools
from policies import Floats
from tests.learning.logs import listened, log, logs

EVERY = {**BASELINES, **BOOSTED}
LOG = listened(users=6, count=120, arms=5, seed=4)


@pytest.fixture(autouse=True, scope="module")
def one_thread() -> Iterator[None]:
    """Threads that wait for one another are slow where processors are busy."""
    try:
        threadpoolctl = importlib.import_module("threadpoolctl")
        importlib.import_module("sklearn.ensemble")
    except ModuleNotFoundError:
        yield
    else:
        with threadpoolctl.threadpool_limits(1):
            yield


@pytest.fixture(params=list(EVERY))
def forecaster(request: pytest.FixtureRequest) -> Forecaster:
    if request.param in BOOSTED:
        pytest.importorskip("sklearn")
    return EVERY[str(request.param)]


def loss(chances: Floats, plays: Plays, rows: Bools) -> float:
    scored = rows & (plays.liked != NONE)
    return float(losses(chances[scored], plays.liked[scored]).mean())


def changed(plays: Plays, rows: Bools, answer: int) -> Plays:
    answers = plays.answer.copy()
    answers[rows] = answer
    return Plays(
        plays.user, plays.arm, answers, plays.seconds, None, plays.users, plays.arms
    )


@settings(max_examples=20, deadline=None)
@given(plays=logs(), share=st.floats(0, 0.9), answer=st.integers(NONE, 1))
@pytest.mark.parametrize("name", BASELINES)
def test_an_answer_changes_only_later_forecasts_of_its_user(
    name: str, plays: Plays, share: float, answer: int
) -> None:
    for row in np.flatnonzero(~plays.earliest(share))[:3]:
        check_no_peeking(BASELINES[name], plays, share, row, answer)


@pytest.mark.parametrize("name", BOOSTED)
def test_an_answer_changes_only_later_forecasts_of_boosting(name: str) -> None:
    pytest.importorskip("sklearn")
    for row in (100, 230):
        check_no_peeking(BOOSTED[name], LOG, 0.7, row, 1 - LOG.answer[row])


def check_no_peeking(
    forecaster: Forecaster, plays: Plays, share: float, row: int, answer: int
) -> None:
    """Change the answer of a play that does not train."""
    rows, train = np.arange(len(plays)), plays.earliest(share)
    other = changed(plays, rows == row, answer)

    before, after = forecaster(plays, train), forecaster(other, train)

    later = (plays.user == plays.user[row]) & (rows > row)
    assert_array_equal(before[~later], after[~later])


def test_what_is_learned_is_learned_in_training(forecaster: Forecaster) -> None:
    train = LOG.earliest(0.7) & (LOG.user < 5)
    other = changed(LOG, LOG.user == 5, 1)

    before, after = forecaster(LOG, train), forecaster(other, train)

    assert_array_equal(before[LOG.user < 5], after[LOG.user < 5])


@settings(max_examples=10, deadline=None)
@given(plays=logs(), share=st.floats(0, 1))
@pytest.mark.parametrize("name", EVERY)
def test_any_log_has_forecasts(name: str, plays: Plays, share: float) -> None:
    if name in BOOSTED:
        pytest.importorskip("sklearn")
    for known in (
        plays,
        log(plays.user.tolist(), plays.arm.tolist(), plays.answer.tolist()),
    ):
        chances = EVERY[name](known, known.earliest(share))

        assert chances.shape == (len(plays),)
        assert ((chances > 0) & (chances < 1)).all()


@pytest.mark.parametrize("name", [name for name in EVERY if name != "constant"])
def test_a_forecaster_beats_the_constant(name: str) -> None:
    if name in BOOSTED:
        pytest.importorskip("sklearn")
    plays = listened(users=40, count=200, arms=8, seed=5)
    train = plays.earliest(0.7)
    test = ~train & plays.repeated

    least = loss(BASELINES["constant"](plays, train), plays, test)

    assert loss(EVERY[name](plays, train), plays, test) < least - 0.01


@pytest.mark.parametrize("name", [name for name in EVERY if "mood" not in name])
def test_mood_helps_where_it_matters(name: str) -> None:
    if name in BOOSTED:
        pytest.importorskip("sklearn")
    plays = listened(users=40, count=200, arms=8, seed=6)
    train = plays.earliest(0.7)
    moody = "mood alone" if name == "constant" else f"{name}, mood"

    without, told = EVERY[name](plays, train), EVERY[moody](plays, train)

    assert loss(told, plays, ~train) < loss(without, plays, ~train) - 0.02


def test_static_classes_are_found() -> None:
    rng, like = np.random.default_rng(7), np.array([0.05, 0.4, 0.7, 0.95])
    rates = rng.choice(like, (200, 10))
    user, arm = np.repeat(np.arange(200), 200), rng.integers(10, size=40_000)
    answer = (rng.random(40_000) < rates[user, arm]).astype(int)
    plays = log(user.tolist(), arm.tolist(), answer.tolist())
    train = plays.earliest(0.7)
    so_far = tally(before(plays, plays.arm, 10), plays.liked)
    likes, others = so_far.likes[:, None], (so_far.answers - so_far.likes)[:, None]
    weight = like**likes * (1 - like) ** others
    best = loss(weight @ like / weight.sum(axis=1), plays, ~train)

    found = loss(BASELINES["four static classes"](plays, train), plays, ~train)

    assert best - 0.0005 < found < best + 0.001
    assert found < loss(arm_rate(plays, train), plays, ~train)


def test_unanswered_plays_count_neither_way() -> None:
    answered = LOG.liked != NONE
    train = LOG.earliest(0.7)

    for rate in (user_rate, arm_rate):
        whole = rate(LOG, train)[answered]
        assert_allclose(whole, rate(LOG.of(answered), train[answered]), rtol=1e-12)


@given(plays=logs(most=20), share=st.floats(0, 1))
def test_a_rate_is_shrunk_by_the_best_strength(plays: Plays, share: float) -> None:
    train, base = plays.earliest(share), user_rate(plays, plays.earliest(share))
    tried = [shares_in_loops(plays, base, strength) for strength in STRENGTHS]
    known = train & (plays.liked != NONE)
    reached = [losses(rates[known], plays.liked[known]).sum() for rates in tried]

    rates = arm_rate(plays, train)

    assert_allclose(rates, tried[int(np.argmin(np.round(reached, 9)))], rtol=1e-6)


def shares_in_loops(plays: Plays, base: Floats, strength: float) -> Floats:
    shares = np.empty(len(plays))
    for row in range(len(plays)):
        same = (plays.user == plays.user[row]) & (plays.arm == plays.arm[row])
        told = plays.liked[:row][same[:row] & (plays.liked[:row] != NONE)]
        shares[row] = (told.sum() + strength * base[row]) / (len(told) + strength)
    return shares


def test_regression_is_that_of_scikit_learn() -> None:
    linear = pytest.importorskip("sklearn.linear_model")
    rng = np.random.default_rng(8)
    matrix = rng.normal(size=(3000, 4)).astype(np.float32)
    odds = matrix @ [1.0, -2.0, 0.5, 0.0] + 0.3
    liked = (rng.random(3000) < 1 / (1 + np.exp(-odds))).astype(np.int8)
    with_one = np.column_stack((matrix, np.ones(3000)))
    peer = linear.LogisticRegression(C=1 / RIDGE, fit_intercept=False, tol=1e-10)

    weights = fitted(matrix, liked)

    assert_allclose(weights, peer.fit(with_one, liked).coef_[0], atol=1e-5)


def test_regression_ends_where_answers_are_told_apart_in_full() -> None:
    matrix = np.array([[-1e6], [-1e6], [1e6]], dtype=np.float32)

    weights = fitted(matrix, np.array([0, 0, 1], dtype=np.int8))

    assert np.isfinite(weights).all()
    assert weights[0] > 0


def test_boosting_alone_needs_scikit_learn(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "sklearn"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "sklearn", None)
    train = LOG.earliest(0.7)

    for forecaster in BASELINES.values():
        forecaster(LOG, train)
    for forecaster in BOOSTED.values():
        with pytest.raises(ModuleNotFoundError, match=r"sklearn .* extra `learn`"):
            forecaster(LOG, train)
