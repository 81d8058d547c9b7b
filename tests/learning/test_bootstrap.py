"""How sure means are."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from learning.bootstrap import interval, mean_and_error, resampled


def test_users_are_drawn_with_all_their_plays() -> None:
    sums, plays = np.array([[2.0, 4.0], [30.0, 30.0]]), np.array([[2], [10]])

    drawn = resampled(sums, plays, 2000, 1)

    possible = {(1.0, 2.0), (3.0, 3.0), (32 / 12, 34 / 12)}
    assert {tuple(row) for row in drawn.tolist()} == possible
    both = np.isclose(drawn[:, 0], 32 / 12).mean()
    assert both == pytest.approx(0.5, abs=0.05)
    assert_array_equal(drawn, resampled(sums, plays, 2000, 1))


def test_an_interval_covers_what_it_should() -> None:
    rng = np.random.default_rng(2)
    covered = 0
    for _ in range(300):
        plays = rng.integers(1, 40, size=(200, 1))
        means = rng.normal(0.5, 0.1, size=(200, 1))
        low, high = interval(resampled(plays * means, plays, 300, 1)[:, 0])
        covered += low < 0.5 < high

    assert covered / 300 == pytest.approx(0.94, abs=0.04)


def test_errors_are_those_of_means_over_drawn_users() -> None:
    rng = np.random.default_rng(5)
    counts = rng.integers(1, 40, (300, 1))
    sums = counts * rng.normal(0.3, 0.1, (300, 1))

    mean, error = mean_and_error(sums[:, 0], counts[:, 0])

    assert mean == pytest.approx(sums.sum() / counts.sum())
    assert_allclose(error, resampled(sums, counts, 4000, 1).std(), rtol=0.06)
