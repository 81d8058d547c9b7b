"""Forecasters before the same plays, scored."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from learning.bootstrap import interval, resampled
from learning.evaluation.forecaster import Forecaster
from learning.evaluation.metrics import auc, losses, squares
from learning.evaluation.reliability import Reliability, by_count, by_width
from learning.plays import NONE, Bools, Plays
from policies import Floats, Ints

Interval = tuple[float, float]

RESAMPLES = 2000
SEED = 1


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """How good a forecaster is.

    Attributes:
        forecaster: its name.
        log_loss: mean over all plays, in nats.
        log_loss_ci95: by resampling users; see `bootstrap`.
        difference: of the log loss to that of the first forecaster.
        difference_ci95: over the same resamples.
        brier: mean square of the error.
        auc: see `metrics.auc`; NaN where all plays are alike.
        by_user: log loss of each user of the evaluation.
        by_count: reliability in bins of as many plays each.
        by_width: reliability in bins as wide as one another.
    """

    forecaster: str
    log_loss: float
    log_loss_ci95: Interval
    difference: float
    difference_ci95: Interval
    brier: float
    auc: float
    by_user: Floats
    by_count: Reliability
    by_width: Reliability

    def summary(self) -> dict[str, Any]:
        """Return the figures that are one number each, as JSON can hold them."""
        return {
            "log_loss": self.log_loss,
            "log_loss_ci95": list(self.log_loss_ci95),
            "difference": self.difference,
            "difference_ci95": list(self.difference_ci95),
            "brier": self.brier,
            "auc": self.auc if isfinite(self.auc) else None,
            "ece": self.by_count.error,
            "ece_by_width": self.by_width.error,
        }

    def plain(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return {
            "forecaster": self.forecaster,
            **self.summary(),
            "by_user": self.by_user.tolist(),
            "by_count": self.by_count.plain(),
            "by_width": self.by_width.plain(),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """Forecasters, scored by the last plays of each user.

    Attributes:
        share: of each user's plays that trained, from the first.
        repeats: whether only plays of an arm that the user was played before count.
        users: U names of those who have plays that count.
        plays: (U,) how many.
        scores: of the forecasters, in order.
    """

    share: float
    repeats: bool
    users: Sequence[str]
    plays: Ints
    scores: Sequence[Score]

    def plain(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return {
            "share": self.share,
            "repeats": self.repeats,
            "users": list(self.users),
            "plays": self.plays.tolist(),
            "scores": [score.plain() for score in self.scores],
        }


def evaluate(
    plays: Plays,
    forecasters: Mapping[str, Forecaster],
    share: float = 0.7,
    *,
    repeats: bool = True,
) -> Evaluation:
    """Score forecasters by the answered plays after the first `share` of each user's.

    Args:
        plays: of all users.
        forecasters: by name; the others are compared with the first.
        share: of each user's plays that train, from the first.
        repeats: whether only plays of an arm that the user was played before count.

    Raises:
        ValueError: no play counts, or a forecaster gives what is no chance.
    """
    train = plays.earliest(share)
    scored = ~train & (plays.liked != NONE)
    if repeats:
        scored &= plays.repeated
    _check_any(scored)
    chances = {
        name: forecaster(plays, train) for name, forecaster in forecasters.items()
    }
    return Evaluation(share, repeats, *compare(plays, scored, chances))


def compare(
    plays: Plays, scored: Bools, chances: Mapping[str, Floats]
) -> tuple[Sequence[str], Ints, Sequence[Score]]:
    """Score forecasts by some of the answered plays.

    Args:
        plays: of all users.
        scored: (P,) whether a play counts.
        chances: (P,) of a like, by name; the others are compared with the first.

    Returns:
        U names of users who have plays that count, (U,) how many, and the scores.

    Raises:
        ValueError: no play counts, or a forecast is no chance.
    """
    _check_any(scored)
    held = plays.of(scored)
    users, user, counts = np.unique(held.user, return_inverse=True, return_counts=True)
    counted = {name: _counted(name, given, scored) for name, given in chances.items()}
    sums = np.empty((len(users), len(counted)))
    for f, chance in enumerate(counted.values()):
        sums[:, f] = np.bincount(user, losses(chance, held.liked))
    drawn = resampled(sums, counts[:, None], RESAMPLES, SEED)
    mean = sums.sum(axis=0) / counts.sum()
    scores = [
        Score(
            name,
            float(mean[f]),
            interval(drawn[:, f]),
            float(mean[f] - mean[0]),
            interval(drawn[:, f] - drawn[:, 0]),
            float(squares(chance, held.liked).mean()),
            auc(chance, held.liked),
            sums[:, f] / counts,
            by_count(chance, held.liked),
            by_width(chance, held.liked),
        )
        for f, (name, chance) in enumerate(counted.items())
    ]
    return [plays.users[u] for u in users], counts, scores


def _check_any(scored: Bools) -> None:
    if not scored.any():
        raise ValueError("plays: hold none to score after those that train")


def _counted(name: str, given: Floats, scored: Bools) -> Floats:
    chances = np.asarray(given, dtype=np.float64)
    if chances.shape != scored.shape or not ((chances >= 0) & (chances <= 1)).all():
        raise ValueError(f"{name}: must give a chance, from 0 to 1, for each play")
    return chances[scored]
