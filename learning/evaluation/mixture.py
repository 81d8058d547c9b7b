"""Pairs of a user and an arm in a few classes, which never change.

What a chain that neither tires nor recovers could tell: a pair is of class c with
chance share[u, c], and is liked with chance like[c, m] in mood m, each play apart.
Learned by expectation and maximisation; forecast by the posterior so far.
"""

from typing import NamedTuple

import numpy as np

from learning.evaluation.mood import MOOD, moods
from learning.plays import NONE, Answers, Bools, Plays
from policies import Floats, Ints
from policies.compiled import compiled

CLASSES = 4
STEPS = 200
SMALL = 1e-5  # log-likelihood that a step must add, per play
SHARED = 10.0  # pairs of a user's that speak for everyone's shares
SMOOTHED = 1.0  # plays of each class and mood that speak for the class's like rate


class _Log(NamedTuple):
    """Plays as the mixture sees them.

    Attributes:
        pair: (P,) number of the user and arm.
        mood: (P,).
        liked: (P,) see `Plays.liked`.
        user: (Q,) whose each pair is.
    """

    pair: Ints
    mood: Ints
    liked: Answers
    user: Ints


class _Fit(NamedTuple):
    """What is learned. `share`: (U, C) of classes; `like`: (C, M) chances."""

    share: Floats
    like: Floats


def mixture(plays: Plays, train: Bools) -> Floats:
    """Forecast by classes of pairs with a like rate each."""
    return _forecast(plays, train, np.zeros(len(plays), dtype=np.int64), 1)


def mixture_with_mood(plays: Plays, train: Bools) -> Floats:
    """Forecast by classes of pairs with a like rate in each mood."""
    return _forecast(plays, train, moods(plays), MOOD.classes)


def _forecast(plays: Plays, train: Bools, mood: Ints, kinds: int) -> Floats:
    fit = _fitted(_log(plays.of(train), mood[train]), len(plays.users), kinds)
    log = _log(plays, mood)
    return _forecasts(log, np.log(fit.share)[log.user], fit.like)


def _log(plays: Plays, mood: Ints) -> _Log:
    arms = max(len(plays.arms), 1)
    pairs, pair = np.unique(plays.user * arms + plays.arm, return_inverse=True)
    return _Log(pair, mood, plays.liked, pairs // arms)


def _fitted(log: _Log, users: int, kinds: int) -> _Fit:
    """Return the fit of most likelihood that is climbed to from classes far apart."""
    like = np.repeat((np.arange(CLASSES) + 0.5) / CLASSES, kinds).reshape(-1, kinds)
    fit = _Fit(np.full((users, CLASSES), 1 / CLASSES), like)
    last, answered = -np.inf, np.count_nonzero(log.liked != NONE)
    for _ in range(STEPS):
        odds = np.log(fit.share)[log.user]
        _weigh(log, np.log(fit.like), np.log1p(-fit.like), odds)
        most = odds.max(axis=1, initial=-np.inf, keepdims=True)
        weight = np.exp(odds - most)
        total = weight.sum(axis=1, keepdims=True)
        reached = float((most + np.log(total)).sum())
        fit = _maximised(log, weight / total, fit)
        if reached - last < SMALL * answered:
            break
        last = reached
    return fit


def _maximised(log: _Log, weight: Floats, fit: _Fit) -> _Fit:
    """Return the fit of most likelihood, given how much each pair is of each class."""
    likes, answers = _counted(log, weight, fit.like.shape[1])
    middle = likes.sum(axis=1, keepdims=True) + 1
    middle = middle / (answers.sum(axis=1, keepdims=True) + 2)
    mine = np.zeros_like(fit.share)
    np.add.at(mine, log.user, weight)
    shared = mine.sum(axis=0) + 1
    shares = mine + SHARED * shared / shared.sum()
    return _Fit(
        shares / shares.sum(axis=1, keepdims=True),
        (likes + SMOOTHED * middle) / (answers + SMOOTHED),
    )


@compiled
def _weigh(log: _Log, like: Floats, other: Floats, odds: Floats) -> None:
    """Add to (Q, C) log odds what the answers say; `like`, `other`: (C, M) logs."""
    for p in range(len(log.pair)):
        if log.liked[p] != NONE:
            told = like if log.liked[p] else other
            for c in range(odds.shape[1]):
                odds[log.pair[p], c] += told[c, log.mood[p]]


@compiled
def _counted(log: _Log, weight: Floats, moods: int) -> tuple[Floats, Floats]:
    """Return (C, M) likes and (C, M) answers, by how much pairs (Q, C) are of each."""
    likes, answers = np.zeros((2, weight.shape[1], moods))
    for p in range(len(log.pair)):
        if log.liked[p] != NONE:
            for c in range(weight.shape[1]):
                answers[c, log.mood[p]] += weight[log.pair[p], c]
                likes[c, log.mood[p]] += log.liked[p] * weight[log.pair[p], c]
    return likes, answers


@compiled
def _forecasts(log: _Log, odds: Floats, like: Floats) -> Floats:
    """Return (P,) chances of a like; (Q, C) log odds learn of each answer in turn."""
    chances = np.empty(len(log.pair))
    for p in range(len(chances)):
        pair, mood = log.pair[p], log.mood[p]
        most, total, liked = odds[pair].max(), 0.0, 0.0
        for c in range(odds.shape[1]):
            weight = np.exp(odds[pair, c] - most)
            total += weight
            liked += weight * like[c, mood]
        chances[p] = liked / total
        if log.liked[p] != NONE:
            for c in range(odds.shape[1]):
                chance = like[c, mood] if log.liked[p] else 1.0 - like[c, mood]
                odds[pair, c] += np.log(chance)
    return chances
