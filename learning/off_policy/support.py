"""Whether a log can answer for a policy.

On average over what a log's policy might have chosen, weights are one, if it could have
chosen all that the other policy chooses. What is missing to one is the chance with
which the other policy chooses what the log's never did. Weights tell, too, how many
plays of the other policy a log is worth (Kong 1992): (sum w)^2 / sum w^2.
"""

from dataclasses import dataclass

import numpy as np

from learning.bootstrap import mean_and_error
from learning.off_policy.cannot import CannotAnswer, Reason
from learning.off_policy.choices import Choices
from policies import Floats, Ints

SURE = 3.0  # standard errors
MATTERS = 0.01  # of all that the other policy chooses
ROUNDED = 1e-6  # as files keep propensities


@dataclass(frozen=True, slots=True)
class Support:
    """What weights tell of a log.

    Attributes:
        mean: of the weights.
        error: standard error of the mean, users being drawn.
        most: greatest weight.
        effective: plays of the other policy that the answers are worth.
        lost: mean of what was cut off from weights. Rewards are at most one, so what is
            estimated with weights cut off is wrong by up to that; `ips` and `pdis` only
            ever too low.
    """

    mean: float
    error: float
    most: float
    effective: float
    lost: float

    @property
    def unsupported(self) -> float:
        """Return the share of the other policy's choices that the log never makes."""
        return max(0.0, 1.0 - self.mean)


def support(choices: Choices, weights: Floats, clip: float | None = None) -> Support:
    """Return what weights tell.

    Args:
        choices: of the log.
        weights: (D,).
        clip: at which weights are cut off for estimates; so for `effective`, too.
    """
    counted = clipped(weights, clip)
    return Support(
        float(weights.mean()),
        _error(weights, choices.user),
        float(weights.max()),
        effective(counted[choices.answered]),
        float((weights - counted).mean()),
    )


def clipped(weights: Floats, clip: float | None) -> Floats:
    """Return weights, cut off."""
    return weights if clip is None else np.minimum(weights, clip)


def effective(weights: Floats) -> float:
    """Return how many plays of one weight are worth as much."""
    squares = float(weights @ weights)
    return float(weights.sum()) ** 2 / squares if squares else 0.0


def _error(values: Floats, user: Ints) -> float:
    """Return the standard error of a mean; what is of one user belongs together."""
    _, row, counts = np.unique(user, return_inverse=True, return_counts=True)
    return mean_and_error(np.bincount(row, values), counts)[1]


def check(found: Support, least: float) -> None:
    """Check that weighted plays can answer.

    Args:
        found: what weights tell.
        least: plays of the other policy that answers must be worth.

    Raises:
        CannotAnswer: they cannot.
    """
    check_effective(found.effective, least)
    amiss = found.mean - 1
    if abs(amiss) <= max(MATTERS, SURE * found.error):
        return
    if amiss < 0:
        raise CannotAnswer(
            Reason.UNSUPPORTED,
            f"{found.unsupported:.1%} of what the policy chooses, the log's policy had"
            " no chance to choose: a log that explores would do",
        )
    raise CannotAnswer(
        Reason.WRONG_PROPENSITIES,
        f"weights average {found.mean:.3f}, not 1: propensities are too low, or there"
        " were more candidates than are given",
    )


def check_effective(found: float, least: float) -> None:
    """Check that answers are worth enough plays.

    Raises:
        CannotAnswer: they are not.
    """
    if found < least:
        raise CannotAnswer(
            Reason.FEW_EFFECTIVE,
            f"the answers are worth {found:.1f} plays of the policy, and it takes"
            f" {least:g}: a longer log would do, or a policy more like the log's",
        )


def check_propensities(logged: Floats) -> None:
    """Check the chances with which a log's policy chose.

    Raises:
        CannotAnswer: there is none, or one that is no chance.
    """
    if len(logged) == 0:
        raise CannotAnswer(
            Reason.NO_PROPENSITIES, "the log does not tell how its plays were chosen"
        )
    bad = int(((logged <= 0) | (logged > 1)).sum())
    if bad:
        raise CannotAnswer(
            Reason.BAD_PROPENSITIES, f"{bad} propensities are not above 0 and up to 1"
        )


def check_chance(choices: Choices) -> None:
    """Check that anything was left to chance.

    Raises:
        CannotAnswer: all was certain.
    """
    if (choices.logged == 1).all():
        raise CannotAnswer(
            Reason.DETERMINISTIC_LOG,
            "the log's policy left nothing to chance, so its log tells of no other",
        )


def check_uniform(choices: Choices) -> None:
    """Check that all candidates had the same chance, always.

    Raises:
        CannotAnswer: they had not.
    """
    even = choices.logged * choices.offered
    if not np.allclose(even, 1, rtol=0, atol=ROUNDED):
        raise CannotAnswer(
            Reason.NOT_UNIFORM,
            "the log's policy did not choose uniformly among all candidates: snips is"
            " replay, with weights",
        )
