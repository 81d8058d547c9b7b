"""Rates of groups of users, and whether two differ, told at any time.

Plays of one user are alike, so users are counted, not plays: errors are those of totals
by user (linearised, robust to any dependence within a user).

A difference is tested by a martingale. With m answers that earned x, a user's rate,
shrunk to the mean theta of an arm by M answers, is off it by (x - m theta) / (M + m).
If users' rates follow a beta distribution of that strength, this is a martingale in m,
and its sum over the users of an arm is one in time, in whatever order they come and
answer. So the mean of rates p = x / m, weighted by w = m / (M + m), has independent
increments, and a normal mixture over effects (Robbins 1970) gives a test and intervals
that hold at all times together, however often one looks: the mixture sequential
probability ratio test of Johari, Koomen, Pekelis and Walsh (2022), "Always valid
inference", Operations Research 70; in this form, with the variance V estimated, the
asymptotic confidence sequence of Waudby-Smith, Arbour, Sinha, Kennedy and Ramdas
(2024), "Time-uniform central limit theory and asymptotic confidence sequences", Annals
of Statistics 52. Both are asymptotic in users. How often they err where users' rates
follow something else is simulated in tests/learning/test_sequential.py.
"""

import math
from dataclasses import astuple, dataclass
from statistics import NormalDist

STRENGTH = 8.0  # answers, M
EFFECT = 0.04  # standard deviation of effects that is mixed over
LEAST = 50.0  # users, in effect, of an arm of which anything is said
LEVEL = 0.05
WITHIN = NormalDist().inv_cdf(1 - LEVEL / 2)  # standard errors


@dataclass(frozen=True, slots=True)
class Sums:
    """What is kept of many users; all of it is added up over them.

    Attributes:
        users: who answered anything.
        answered, earned: m and x.
        answered_squared, crossed, earned_squared: m^2, m x and x^2.
        weight, weighted: w and w p.
        weight_squared, weighted_crossed, weighted_squared: w^2, w^2 p and w^2 p^2.
    """

    users: float = 0.0
    answered: float = 0.0
    earned: float = 0.0
    answered_squared: float = 0.0
    crossed: float = 0.0
    earned_squared: float = 0.0
    weight: float = 0.0
    weighted: float = 0.0
    weight_squared: float = 0.0
    weighted_crossed: float = 0.0
    weighted_squared: float = 0.0

    def __add__(self, other: "Sums") -> "Sums":
        pairs = zip(astuple(self), astuple(other), strict=True)
        return Sums(*(mine + its for mine, its in pairs))

    def __neg__(self) -> "Sums":
        return Sums(*(-value for value in astuple(self)))


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value, and the interval that holds it in 95 of 100 cases."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Difference:
    """What an arm earns more than another.

    Attributes:
        value: the difference of mean rates.
        low, high: hold the true one at all times together, but for `level` of cases.
        p: always valid: under no difference it ever falls to `level` in as many cases.
        level: that of the interval.
    """

    value: float
    low: float
    high: float
    p: float
    level: float


def of_user(answered: float, earned: float) -> Sums:
    """Return what one user adds: m answers that earned x, from 0 to m."""
    if answered == 0:
        return Sums()
    weight = answered / (STRENGTH + answered)
    rate = earned / answered
    return Sums(
        1.0,
        answered,
        earned,
        answered**2,
        answered * earned,
        earned**2,
        weight,
        weight * rate,
        weight**2,
        weight**2 * rate,
        (weight * rate) ** 2,
    )


def ratio(sums: Sums) -> tuple[float, float] | None:
    """Return what an answer earns, and the variance of that; None: of fewer than two.

    The variance is that of totals by user.
    """
    if sums.users < 2:  # noqa: PLR2004 - one alone does not vary
        return None
    mean = sums.earned / sums.answered
    apart = (
        sums.earned_squared - 2 * mean * sums.crossed + mean**2 * sums.answered_squared
    )
    few = sums.users / (sums.users - 1)
    return mean, max(apart, 0.0) / sums.answered**2 * few


def rate(sums: Sums) -> Estimate | None:
    """Return the share of answers that were likes, by Wilson's interval.

    It takes as many independent answers as have this variance; one a user, where all
    are alike.
    """
    found = ratio(sums)
    if found is None:
        return None
    mean, variance = found
    spread = mean * (1 - mean)
    count = spread / variance if variance > 0 and spread > 0 else sums.users
    shrink = 1 + WITHIN**2 / count
    middle = (mean + WITHIN**2 / (2 * count)) / shrink
    half = WITHIN / shrink * math.sqrt(spread / count + (WITHIN / (2 * count)) ** 2)
    return Estimate(mean, max(middle - half, 0.0), min(middle + half, 1.0))


def mean(sums: Sums) -> Estimate | None:
    """Return what an answer earns, which may be less than nothing."""
    found = ratio(sums)
    if found is None:
        return None
    value, half = found[0], WITHIN * math.sqrt(found[1])
    return Estimate(value, value - half, value + half)


def in_effect(sums: Sums) -> float:
    """Return how many users of equal weight would vary as little."""
    return sums.weight**2 / sums.weight_squared if sums.weight_squared else 0.0


def difference(arm: Sums, control: Sums, level: float = LEVEL) -> Difference | None:
    """Compare the mean rates of an arm's users and those of another.

    The interval and p may be looked at as often as one likes, and the experiment ended
    because of what is seen. None: there are not enough users to say anything.
    """
    if min(in_effect(arm), in_effect(control)) < LEAST:
        return None
    (first, its), (second, other) = _weighted(arm), _weighted(control)
    apart, variance, mixed = first - second, its + other, EFFECT**2
    total = variance + mixed
    odds = 0.5 * math.log(variance / total)
    odds += apart**2 * mixed / (2 * variance * total)
    half = math.sqrt(variance * total / mixed * math.log(total / (variance * level**2)))
    return Difference(apart, apart - half, apart + half, min(math.exp(-odds), 1), level)


def _weighted(sums: Sums) -> tuple[float, float]:
    """Return the weighted mean of users' rates, and its variance.

    The variance is that which one more user would add who is half of all away from it,
    too: with few users, of whom hardly any differ, it is not trusted.
    """
    mean = sums.weighted / sums.weight
    apart = (
        sums.weighted_squared
        - 2 * mean * sums.weighted_crossed
        + mean**2 * sums.weight_squared
    )
    few = sums.users / (sums.users - 1)
    more = 0.25 / in_effect(sums) ** 2
    return mean, max(apart, 0.0) / sums.weight**2 * few + more
