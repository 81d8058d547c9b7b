"""Whether what is forecast with a chance happens as often."""

from typing import NamedTuple

import numpy as np

from learning.plays import Answers
from policies import Floats, Ints

BINS = 15


class Reliability(NamedTuple):
    """Forecasts in B bins, none of them empty, the lowest first.

    Attributes:
        forecast: (B,) mean chance of a like.
        liked: (B,) share of likes.
        plays: (B,) how many.
    """

    forecast: Floats
    liked: Floats
    plays: Ints

    @property
    def error(self) -> float:
        """Return the expected calibration error: the mean distance of the two."""
        apart = np.abs(self.forecast - self.liked)
        return float(apart @ self.plays / self.plays.sum())

    def plain(self) -> dict[str, list[float]]:
        """Return what JSON can hold."""
        return {name: values.tolist() for name, values in self._asdict().items()}


def by_count(chance: Floats, liked: Answers, bins: int = BINS) -> Reliability:
    """Bin forecasts so that each bin has as many, but for equal ones: these share one.

    Args:
        chance: (P,) of a like.
        liked: (P,) 0 or 1.
        bins: at most so many.
    """
    edges = np.quantile(chance, np.arange(1, bins) / bins, method="inverted_cdf")
    return _binned(chance, liked, np.searchsorted(edges, chance, side="left"), bins)


def by_width(chance: Floats, liked: Answers, bins: int = BINS) -> Reliability:
    """Bin forecasts by equal parts of [0, 1]; see `by_count`."""
    place = np.minimum((chance * bins).astype(np.int64), bins - 1)
    return _binned(chance, liked, place, bins)


def _binned(chance: Floats, liked: Answers, place: Ints, bins: int) -> Reliability:
    plays = np.bincount(place, minlength=bins)
    some = plays > 0
    return Reliability(
        np.bincount(place, chance, bins)[some] / plays[some],
        np.bincount(place, liked, bins)[some] / plays[some],
        plays[some],
    )
