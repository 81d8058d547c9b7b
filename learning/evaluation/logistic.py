"""Logistic regression by Newton's method, and what it makes of features."""

from functools import partial

import numpy as np

from learning.evaluation.features import Features, features
from learning.evaluation.forecaster import Forecaster, chance_of, logit
from learning.evaluation.rates import mood_rate
from learning.plays import NONE, Answers, Bools, Plays
from policies import Floats
from policies.compiled import compiled

RIDGE = 1.0  # plays that speak for log odds near 0
STEPS = 50
SMALL = 1e-6  # twice the loss, in nats, that a step must be able to save


def logistic(plays: Plays, train: Bools) -> Floats:
    """Forecast by logistic regression on shares of likes, last answers and gaps."""
    return _regression(plays, train, features(plays, train, mood=False))


def logistic_with_mood(plays: Plays, train: Bools) -> Floats:
    """Forecast as `logistic`, told the mood and the last answers to anything, too."""
    return _regression(plays, train, features(plays, train, mood=True))


def with_mood(forecaster: Forecaster) -> Forecaster:
    """Return a forecaster that weighs log odds against those of the mood."""
    return partial(_with_mood, forecaster)


def _with_mood(forecaster: Forecaster, plays: Plays, train: Bools) -> Floats:
    rates = forecaster(plays, train), mood_rate(plays, train)
    matrix = np.stack([logit(rate).astype(np.float32) for rate in rates], axis=1)
    return _regression(plays, train, matrix)


def _regression(plays: Plays, train: Bools, matrix: Features) -> Floats:
    """Forecast (P,) from (P, F) features; first plays of an arm have own weights."""
    liked, repeated = plays.liked, plays.repeated
    known, forecasts = train & (liked != NONE), np.empty(len(plays))
    for rows in (repeated, ~repeated):
        weights = fitted(matrix[known & rows], liked[known & rows])
        forecasts[rows] = chance_of(matrix[rows] @ weights[:-1] + weights[-1])
    return forecasts


def fitted(matrix: Features, liked: Answers) -> Floats:
    """Return (F + 1,): the weights of features, and of 1, of least penalised loss.

    Args:
        matrix: (P, F).
        liked: (P,) 0 or 1.
    """
    weights = np.zeros(matrix.shape[1] + 1)
    loss, gradient, hessian = _terms(matrix, liked, weights)
    for _ in range(STEPS):
        step = np.linalg.solve(hessian, gradient)
        if gradient @ step < SMALL:
            break
        after = _terms(matrix, liked, weights - step)
        while after[0] > loss:
            step = step / 2
            after = _terms(matrix, liked, weights - step)
        weights = weights - step
        loss, gradient, hessian = after
    return weights


@compiled
def _terms(
    matrix: Features, liked: Answers, weights: Floats
) -> tuple[float, Floats, Floats]:
    """Return the penalised loss, its gradient and its second derivatives.

    By hand: the threads of a library for products of small matrices cost more than
    they save.
    """
    count = len(weights)
    loss, gradient = RIDGE / 2 * (weights**2).sum(), RIDGE * weights
    hessian, row = RIDGE * np.eye(count), np.ones(count)
    for p in range(len(matrix)):
        row[:-1] = matrix[p]
        odds = 0.0
        for i in range(count):
            odds += row[i] * weights[i]
        chance = 1.0 / (1.0 + np.exp(-odds))
        loss += max(odds, 0.0) + np.log1p(np.exp(-abs(odds))) - liked[p] * odds
        for i in range(count):
            gradient[i] += (chance - liked[p]) * row[i]
            spread = chance * (1.0 - chance) * row[i]
            for j in range(i + 1):
                hessian[i, j] += spread * row[j]
    return loss, gradient, hessian + np.tril(hessian, -1).T
