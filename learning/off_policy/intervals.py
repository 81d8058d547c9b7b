"""How sure ratios of sums are: summed again over users drawn with replacement."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from learning.off_policy.estimators import Ratio
from policies import Floats, Ints

LEVEL = 0.95


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
    sums = np.stack([np.bincount(row, part) for ratio in ratios for part in ratio])
    rng, users = np.random.default_rng(seed), sums.shape[1]
    drawn = np.empty((draws, len(sums)))
    for draw in drawn:
        draw[:] = sums @ np.bincount(rng.integers(0, users, users), minlength=users)
    return Resampled(_ratios(sums.sum(axis=1)), _ratios(drawn))


def _ratios(sums: Floats) -> Floats:
    found: Floats = sums[..., ::2] / sums[..., 1::2]
    return found


def _estimate(mean: float, drawn: Floats) -> Estimate:
    low, high = np.quantile(drawn, ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    return Estimate(float(mean), float(low), float(high))
