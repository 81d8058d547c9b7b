"""Rates of users, and differences that may be looked at as often as one likes."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from learning import Floats
from learning.bootstrap import mean_and_error
from learning.sequential import (
    EFFECT,
    LEVEL,
    STRENGTH,
    Sums,
    difference,
    in_effect,
    mean,
    of_user,
    rate,
    ratio,
)

RUNS = 400
LOOKS = 60
USERS = 300  # of each arm

Ints = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def summed(answered: Floats, earned: Floats) -> Sums:
    total = Sums()
    for m, x in zip(answered.tolist(), earned.tolist(), strict=True):
        total += of_user(m, x)
    return total


def all_at_once(answered: Floats, earned: Floats) -> list[Sums]:
    """The sums of each row of users."""
    m, x = answered, earned
    w = m / (STRENGTH + m)
    p = x / np.maximum(m, 1)
    columns = (m > 0, m, x, m**2, m * x, x**2, w, w * p, w**2, w**2 * p, (w * p) ** 2)
    totals = np.stack([column.sum(axis=1) for column in columns], axis=1)
    return [Sums(*row) for row in totals.tolist()]


def test_what_a_user_adds_can_be_taken_away_and_put_anew() -> None:
    before, after = of_user(3, 1.0), of_user(7, 4.5)

    moved = summed(np.array([3.0, 2.0]), np.array([1.0, 2.0])) + -before + after

    expected = summed(np.array([7.0, 2.0]), np.array([4.5, 2.0]))
    assert moved.earned == expected.earned == 6.5
    assert moved.weighted_squared == pytest.approx(expected.weighted_squared)
    assert all_at_once(np.array([[7.0, 2.0]]), np.array([[4.5, 2.0]])) == [expected]


def test_the_error_of_a_rate_is_that_of_totals_by_user() -> None:
    rng = np.random.default_rng(0)
    answered = rng.integers(1, 60, 200).astype(float)
    earned = rng.binomial(answered.astype(int), rng.beta(1, 2, 200)).astype(float)

    found = ratio(summed(answered, earned))

    value, error = mean_and_error(earned, answered.astype(np.int64))
    assert found == pytest.approx((value, error**2))
    shown = rate(summed(answered, earned))
    assert shown is not None
    assert shown.value == value
    assert shown.low == pytest.approx(value - 1.96 * error, abs=0.1 * error)


def test_a_rate_of_users_who_are_all_alike_is_not_certain() -> None:
    nobody_liked = rate(summed(np.full(40, 50.0), np.zeros(40)))

    assert nobody_liked is not None
    assert nobody_liked.value == 0.0
    assert nobody_liked.low == pytest.approx(0.0, abs=1e-12)
    assert nobody_liked.high == pytest.approx(1.96**2 / (40 + 1.96**2), rel=1e-3)
    assert rate(of_user(3, 1)) is None
    assert rate(Sums()) is None


def test_a_mean_may_be_less_than_nothing() -> None:
    found = mean(summed(np.array([2.0, 2.0, 4.0]), np.array([-0.5, -0.1, 0.0])))

    assert found is not None
    assert found.value == pytest.approx(-0.075)
    assert found.low < found.value < found.high


def test_the_interval_is_where_the_test_ends() -> None:
    """With the difference at an end of its interval, p is the level."""
    rng = np.random.default_rng(1)
    arm, control = (
        summed(np.full(300, 12.0), rng.binomial(12, shift + 0.4, 300).astype(float))
        for shift in (0.05, 0.0)
    )

    found = difference(arm, control)

    assert found is not None
    variance = _variance(arm) + _variance(control)
    total = variance + EFFECT**2
    edge = found.high - found.value
    evidence = math.sqrt(variance / total) * math.exp(
        edge**2 * EFFECT**2 / (2 * variance * total)
    )
    assert evidence == pytest.approx(1 / LEVEL)
    assert found.low > 0
    assert found.p < LEVEL


def _variance(sums: Sums) -> float:
    mean = sums.weighted / sums.weight
    squares = (
        sums.weighted_squared
        - 2 * mean * sums.weighted_crossed
        + mean**2 * sums.weight_squared
    )
    few = sums.users / (sums.users - 1)
    return few * squares / sums.weight**2 + 0.25 / in_effect(sums) ** 2


def test_of_few_users_nothing_is_said() -> None:
    few, many = np.full(30, 500.0), np.full(200, 5.0)

    said = difference(summed(few, few), summed(many, many / 2))

    assert said is None


def plays_of(kind: str, rng: np.random.Generator) -> Iterator[Ints]:
    """How many plays each user of each run has between looks."""
    shape = (RUNS, USERS)
    tempo = np.full(shape, 0.8)
    begins, ends = np.zeros(shape), np.full(shape, float(LOOKS))
    if kind == "heavy":
        tempo = np.minimum(rng.pareto(1.1, shape), 60.0) / 3
    if kind in {"arriving", "leaving"}:
        begins = rng.uniform(0, LOOKS, shape)
    if kind == "leaving":
        ends = begins + rng.exponential(LOOKS / 20, shape)
    if kind == "late and many":  # one-time users first, then some who play a lot
        regular = rng.random(shape) < 0.3
        begins = np.where(regular, LOOKS / 2, rng.uniform(0, LOOKS, shape))
        ends = np.where(regular, LOOKS, begins + 1)
        tempo = np.where(regular, 4.0, 1.0)
    for look in range(LOOKS):
        yield rng.poisson(tempo * ((begins <= look) & (look < ends)))


def errors(
    kind: str, spread: str, *, effect: float = 0.0, seed: int = 0
) -> tuple[float, float]:
    """How often two arms are told apart by somebody who looks all the time.

    With the test, and with an interval of one look.
    """
    rng = np.random.default_rng(seed)
    arms = [[np.zeros((RUNS, USERS)) for _ in range(2)] for _ in range(2)]
    rates = [np.clip(_rates(spread, rng) + shift, 0, 1) for shift in (effect, 0.0)]
    told, naive = np.zeros(RUNS, bool), np.zeros(RUNS, bool)
    for more in zip(*(plays_of(kind, rng) for _ in arms), strict=True):
        for arm, like, plays in zip(arms, rates, more, strict=True):
            chance = like
            if spread == "tiring":
                chance = like * (0.5 + 0.5 * np.exp(-arm[0] / 15))
            arm[0] += plays
            arm[1] += rng.binomial(plays, chance)
        found = [all_at_once(m, x) for m, x in arms]
        for run, (first, second) in enumerate(zip(*found, strict=True)):
            compared = difference(first, second)
            if compared is not None:
                told[run] |= compared.p <= LEVEL
                width = 1.96 * math.sqrt(_variance(first) + _variance(second))
                naive[run] |= abs(compared.value) > width
    return float(told.mean()), float(naive.mean())


def _rates(spread: str, rng: np.random.Generator) -> Floats:
    shape = (RUNS, USERS)
    if spread == "two kinds":
        return np.where(rng.random(shape) < 0.5, 0.1, 0.9)
    if spread == "alike":
        return np.full(shape, 0.3)
    if spread == "rare":
        return rng.beta(0.2, 9.8, shape)
    return rng.beta(3, 5, shape)


@pytest.mark.parametrize(
    ("kind", "spread"),
    [
        ("steady", "beta"),
        ("arriving", "beta"),
        ("leaving", "beta"),
        ("heavy", "two kinds"),
        ("late and many", "two kinds"),
        ("steady", "alike"),
        ("arriving", "tiring"),
        ("leaving", "rare"),
    ],
)
def test_who_looks_all_the_time_errs_no_more_often_than_agreed(
    kind: str, spread: str
) -> None:
    told, naive = errors(kind, spread)

    assert told <= LEVEL
    assert naive > LEVEL  # who takes each look for the only one


def test_a_difference_that_matters_is_found() -> None:
    told, _ = errors("arriving", "beta", effect=0.1)

    assert told > 0.9
