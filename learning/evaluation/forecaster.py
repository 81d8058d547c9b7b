"""What is evaluated: something that says how likely a like is."""

from collections.abc import Callable

import numpy as np

from learning.plays import Bools, Plays
from policies import Floats

LEAST = 1e-12  # a chance is held to be no less, and no more than 1 - LEAST

Forecaster = Callable[[Plays, Bools], Floats]
"""Given plays and which of them (P,) train, return (P,) the chance of a like of each.

Parameters are learned from the plays that train alone. Each play is forecast from what
lay before it in its user's rows, whether that trained or not: never from its own
answer, a later one, or the end of the play.
"""


def logit(chance: Floats) -> Floats:
    """Return the log odds of chances, those of 0 and 1 as of LEAST from them."""
    held = np.clip(chance, LEAST, 1.0 - LEAST)
    return np.log(held) - np.log1p(-held)


def chance_of(logit: Floats) -> Floats:
    """Return the chances of log odds, of any size."""
    return np.exp(-np.logaddexp(0.0, -logit))
