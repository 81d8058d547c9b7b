"""How sure ratios of sums are: summed again over users drawn with replacement."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from learning import bootstrap
from learning.off_policy.estimators import Ratio
from policies import Floats, Ints


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean, with its 95 % interval."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Resampled:
    """R ratios, and what they are of B draws of users; the first is compared with.

    Attributes:
        mean: (R,).
        drawn: (B, R).
    """

    mean: Floats
    drawn: Floats

    def estimate(self, row: int) -> Estimate:
        """Return one of the ratios."""
        return _estimate(self.mean[row], self.drawn[:, row])

    def gain(self, row: int) -> Estimate:
        """Return how much it is above the first one."""
        apart = self.drawn[:, row] - self.drawn[:, 0]
        return _estimate(self.mean[row] - self.mean[0], apart)


def resampled(ratios: Sequence[Ratio], user: Ints, draws: int, seed: int) -> Resampled:
    """Return ratios of sums over plays, users being drawn.

    Args:
        ratios: R.
        user: (D,) of each play.
        draws: B.
        seed: of them.
    """
    _, row = np.unique(user, return_inverse=True)
    top, bottom = (
        np.stack([np.bincount(row, part) for part in parts], axis=1)
        for parts in zip(*ratios, strict=True)
    )
    mean: Floats = top.sum(axis=0) / bottom.sum(axis=0)
    return Resampled(mean, bootstrap.resampled(top, bottom, draws, seed))


def _estimate(mean: float, drawn: Floats) -> Estimate:
    return Estimate(float(mean), *bootstrap.interval(drawn))
