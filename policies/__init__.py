"""The decision core: beliefs about users, and policies that act on them.

Pure functions of arrays and seeds; knows nothing of a database, a clock or a request.
"""

from policies.arrays import Floats, Ints, as_floats, as_ints
from policies.bayes import LIKE, NONE, SKIP
from policies.belief import (
    MOST_SURPRISE,
    Answered,
    answered,
    expected_like,
    forecast,
    replayed,
    rested,
    untouched,
)
from policies.choice import Choice, choose
from policies.model import InvalidModel, Model
from policies.model_set import ModelSet
from policies.parameters import Bounds, Parameter, parameters
from policies.policy import Policy, Scorer
from policies.registry import POLICIES, create
from policies.situation import NEVER, Situation
from policies.warm_up import warm_up

__all__ = [
    "LIKE",
    "MOST_SURPRISE",
    "NEVER",
    "NONE",
    "POLICIES",
    "SKIP",
    "Answered",
    "Bounds",
    "Choice",
    "Floats",
    "Ints",
    "InvalidModel",
    "Model",
    "ModelSet",
    "Parameter",
    "Policy",
    "Scorer",
    "Situation",
    "answered",
    "as_floats",
    "as_ints",
    "choose",
    "create",
    "expected_like",
    "forecast",
    "parameters",
    "replayed",
    "rested",
    "untouched",
    "warm_up",
]
