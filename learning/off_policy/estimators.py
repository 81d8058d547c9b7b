"""Estimates of what a policy earns a play, as ratios of sums over answered plays.

With w the chance with which the policy chooses the arm, over that with which the log's
did, r the reward, and by the models q of the arm and v of the policy's choice:

    replay  sum(t r) / sum(t)     t the policy's chance; of a uniform log only
    ips     mean(w r)
    snips   sum(w r) / sum(w)
    dr      mean(v + w (r - q))

Replay keeps the plays on which the policy agrees (Li, Chu, Langford and Wang 2011); one
that chooses by lot agrees in part. Inverse propensity scores are unbiased (Horvitz and
Thompson 1952); normalised by themselves, they are biased a little and vary less
(Swaminathan and Joachims 2015). The doubly robust one is unbiased whatever the models
say, and varies less the better they are (Dudik, Langford and Li 2011). All count
answered plays: answers must not be missing by what they would have been. Where they are
missing by arm, `snips` still is right for plays that are answered.
"""

from typing import NamedTuple

import numpy as np

from learning.off_policy.choices import Choices
from policies import Floats


class Ratio(NamedTuple):
    """A ratio of sums.

    Attributes:
        top: (D,) summed above.
        bottom: (D,) summed below.
    """

    top: Floats
    bottom: Floats


def logged(choices: Choices) -> Ratio:
    """What the log's policy earned."""
    return Ratio(choices.reward, np.ones_like(choices.reward))


def direct(choices: Choices) -> Ratio:
    """What the models promise of the policy: as wrong as they are."""
    return Ratio(choices.promised, np.ones_like(choices.promised))


def replay(choices: Choices) -> Ratio:
    """The mean of plays on which the policy agrees with the log's."""
    return Ratio(choices.target * choices.reward, choices.target)


def ips(choices: Choices, weights: Floats) -> Ratio:
    """The mean of rewards by weight."""
    return Ratio(weights * choices.reward, np.ones_like(weights))


def snips(choices: Choices, weights: Floats) -> Ratio:
    """The mean of rewards by weight, over the sum of the weights."""
    return Ratio(weights * choices.reward, weights)


def doubly_robust(choices: Choices, weights: Floats) -> Ratio:
    """What the models promise, mended by what they missed of each play."""
    missed = choices.reward - choices.expected
    return Ratio(choices.promised + weights * missed, np.ones_like(weights))
