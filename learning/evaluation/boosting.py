"""Gradient boosting by scikit-learn, told what logistic regression is told.

How many trees there are is chosen by time: as many as forecast the last plays in
training of each user best, learned from those before. Then all that train count.

It runs on OpenMP's threads, which stall one another where processors are busy: there,
OMP_NUM_THREADS=1 was ten times as fast.
"""

import numpy as np

from learning.evaluation.extra import extra
from learning.evaluation.features import features
from learning.evaluation.metrics import losses
from learning.evaluation.rates import constant
from learning.plays import NONE, Bools, Plays
from policies import Floats

EARLY = 0.8  # share of each user's plays in training that choose the number of trees
SETTINGS = {
    "learning_rate": 0.06,
    "min_samples_leaf": 100,
    "l2_regularization": 50.0,
    "max_iter": 500,
    "early_stopping": False,
    "random_state": 1,
}


def boosting(plays: Plays, train: Bools) -> Floats:
    """Forecast by boosted trees on shares of likes, last answers and gaps.

    Raises:
        ModuleNotFoundError: scikit-learn is missing.
    """
    return _forecasts(plays, train, mood=False)


def boosting_with_mood(plays: Plays, train: Bools) -> Floats:
    """Forecast as `boosting`, told the user's last answers to anything, too."""
    return _forecasts(plays, train, mood=True)


def _forecasts(plays: Plays, train: Bools, *, mood: bool) -> Floats:
    with extra():
        from sklearn.ensemble import (  # noqa: PLC0415 - of an extra
            HistGradientBoostingClassifier as Boosting,
        )
    known = train & (plays.liked != NONE)
    liked, early = plays.liked[known], plays.of(known).earliest(EARLY)
    if len(np.unique(liked[early])) <= 1:  # nothing to tell apart
        return constant(plays, train)
    matrix = features(plays, train, mood=mood)
    trained = matrix[known]
    tried = Boosting(**SETTINGS).fit(trained[early], liked[early])
    reached = [
        losses(chance[:, 1], liked[~early]).mean()
        for chance in tried.staged_predict_proba(trained[~early])
    ]
    settings = SETTINGS | {"max_iter": int(np.argmin(reached)) + 1}
    chances: Floats = Boosting(**settings).fit(trained, liked).predict_proba(matrix)
    return chances[:, 1]
