"""Forecasts of likes, scored on the last plays of each user, against a sceptic's.

`evaluate` scores any `Forecaster`; `BASELINES` and `BOOSTED` are those to beat.
`learning.evaluation.plots` draws what was found.
"""

from learning.evaluation.baselines import BASELINES, BOOSTED
from learning.evaluation.forecaster import Forecaster
from learning.evaluation.scores import Evaluation, Score, compare, evaluate
from learning.evaluation.table import table

__all__ = [
    "BASELINES",
    "BOOSTED",
    "Evaluation",
    "Forecaster",
    "Score",
    "compare",
    "evaluate",
    "table",
]
