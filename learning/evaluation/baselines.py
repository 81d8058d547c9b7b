"""What a sceptic would try before a chain, each without and with the mood."""

from collections.abc import Mapping
from types import MappingProxyType

from learning.evaluation.boosting import boosting, boosting_with_mood
from learning.evaluation.forecaster import Forecaster
from learning.evaluation.logistic import logistic, logistic_with_mood, with_mood
from learning.evaluation.mixture import mixture, mixture_with_mood
from learning.evaluation.rates import (
    arm_rate,
    constant,
    mood_rate,
    moving_rate,
    user_rate,
)

BASELINES: Mapping[str, Forecaster] = MappingProxyType(
    {
        "constant": constant,
        "user rate": user_rate,
        "user-arm rate": arm_rate,
        "user-arm moving average": moving_rate,
        "four static classes": mixture,
        "logistic regression": logistic,
        "mood alone": mood_rate,
        "user rate, mood": with_mood(user_rate),
        "user-arm rate, mood": with_mood(arm_rate),
        "user-arm moving average, mood": with_mood(moving_rate),
        "four static classes, mood": mixture_with_mood,
        "logistic regression, mood": logistic_with_mood,
    }
)
BOOSTED: Mapping[str, Forecaster] = MappingProxyType(
    {"gradient boosting": boosting, "gradient boosting, mood": boosting_with_mood}
)
"""Those that need scikit-learn."""
