"""The decision core: beliefs about users, and policies that act on them.

Pure functions of arrays and seeds; knows nothing of a database, a clock or a request.
"""

from policies.arrays import Floats, Ints, as_floats, as_ints
from policies.bayes import LIKE, NONE, SKIP
from policies.belief import (
    MOST_SURPRISE,
    REMEMBERED,
    Answered,
    answered,
    expected_like,
    forecast,
    replayed,
    rested,
    returned,
    untouched,
)
from policies.bounds import Bound, Effort, bound, effort, worth_for_ever
from policies.choice import Choice, Mixture, chances, choose
from policies.index_table import MOST_DISCOUNT, MOST_POINTS, IndexTable, build
from policies.model import NO_ANSWER, InvalidModel, Model, Signals
from policies.model_set import ModelSet, mood_of
from policies.mood import LIKED, NEUTRAL, Mood, MoodState
from policies.parameters import Bounds, Parameter, parameters
from policies.policy import Policy, Scorer
from policies.ready import ready
from policies.registry import POLICIES, create, description, params_of, presets
from policies.rungs import LAST_RESORTS, rungs
from policies.situation import ALONE, NEVER, Situation, Slate
from policies.tables import NO_TABLES, Tables, build_all
from policies.thompson import draws_samples
from policies.warm_up import variants, warm_up

__all__ = [
    "ALONE",
    "LAST_RESORTS",
    "LIKE",
    "LIKED",
    "MOST_DISCOUNT",
    "MOST_POINTS",
    "MOST_SURPRISE",
    "NEUTRAL",
    "NEVER",
    "NONE",
    "NO_ANSWER",
    "NO_TABLES",
    "POLICIES",
    "REMEMBERED",
    "SKIP",
    "Answered",
    "Bound",
    "Bounds",
    "Choice",
    "Effort",
    "Floats",
    "IndexTable",
    "Ints",
    "InvalidModel",
    "Mixture",
    "Model",
    "ModelSet",
    "Mood",
    "MoodState",
    "Parameter",
    "Policy",
    "Scorer",
    "Signals",
    "Situation",
    "Slate",
    "Tables",
    "answered",
    "as_floats",
    "as_ints",
    "bound",
    "build",
    "build_all",
    "chances",
    "choose",
    "create",
    "description",
    "draws_samples",
    "effort",
    "expected_like",
    "forecast",
    "mood_of",
    "parameters",
    "params_of",
    "presets",
    "ready",
    "replayed",
    "rested",
    "returned",
    "rungs",
    "untouched",
    "variants",
    "warm_up",
    "worth_for_ever",
]
