"""Measures of forecasts, against loops, and against scikit-learn's."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from learning.evaluation.metrics import auc, losses, squares
from learning.evaluation.reliability import Reliability, by_count, by_width
from learning.plays import Answers
from policies import Floats

Forecasts = tuple[Floats, Answers]


@st.composite
def forecasts(draw: st.DrawFn) -> Forecasts:
    """Chances, many of them equal, and answers."""
    chance = st.sampled_from([0.0, 0.1, 0.25, 0.5, 1.0]) | st.floats(0, 1)
    rows = st.tuples(chance, st.integers(0, 1))
    chances, answers = zip(*draw(st.lists(rows, min_size=1)), strict=True)
    return np.array(chances), np.array(answers, dtype=np.int8)


@given(forecasts())
def test_losses_are_those_of_loops(given: Forecasts) -> None:
    for loss, square, chance, liked in zip(
        losses(*given), squares(*given), *given, strict=True
    ):
        held = min(max(chance if liked else 1 - chance, 1e-12), 1 - 1e-12)
        assert loss == pytest.approx(-np.log(held), abs=1e-15)
        assert square == pytest.approx((liked - chance) ** 2)


@given(forecasts())
def test_auc_counts_pairs_in_the_right_order(given: Forecasts) -> None:
    chance, liked = given
    pairs = [
        float(high > low) + 0.5 * float(high == low)
        for high, low in product(chance[liked == 1], chance[liked == 0])
    ]

    expected = np.mean(pairs) if pairs else np.nan

    assert_allclose(auc(chance, liked), expected)


def test_auc_is_that_of_scikit_learn() -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    rng = np.random.default_rng(1)
    chance = rng.random(5000).round(2)
    liked = (rng.random(5000) < chance).astype(np.int8)

    assert auc(chance, liked) == pytest.approx(metrics.roc_auc_score(liked, chance))


@given(forecasts())
def test_bins_hold_every_play_once(given: Forecasts) -> None:
    chance, liked = given

    for bins in (by_count(chance, liked), by_width(chance, liked)):
        assert bins.plays.sum() == len(chance)
        assert bins.plays.min() > 0
        assert_allclose(bins.plays @ bins.forecast, chance.sum(), atol=1e-9)
        assert_allclose(bins.plays @ bins.liked, liked.sum(), atol=1e-9)
        assert_array_equal(np.sort(bins.forecast), bins.forecast)


@given(forecasts())
def test_the_calibration_error_is_that_of_a_loop(given: Forecasts) -> None:
    chance, liked = given
    error = 0.0
    for number in range(15):
        inside = np.minimum(np.floor(chance * 15), 14) == number
        error += abs(chance[inside].sum() - liked[inside].sum()) / len(chance)

    assert by_width(chance, liked).error == pytest.approx(error, abs=1e-12)


def test_equal_forecasts_share_a_bin() -> None:
    chance, liked = np.full(30, 0.5), np.repeat([0, 1], 15).astype(np.int8)

    assert_bins(by_count(chance, liked), [0.5], [0.5], [30])


def test_bins_by_count_hold_as_many() -> None:
    chance = np.arange(30) / 30
    liked = (chance >= 0.5).astype(np.int8)

    found = by_count(chance, liked, bins=3)

    assert_bins(found, [4.5 / 30, 14.5 / 30, 24.5 / 30], [0, 0.5, 1], [10, 10, 10])


def assert_bins(
    found: Reliability, forecast: list[float], liked: list[float], plays: list[int]
) -> None:
    assert_allclose(found.forecast, forecast)
    assert_allclose(found.liked, liked)
    assert_array_equal(found.plays, plays)
