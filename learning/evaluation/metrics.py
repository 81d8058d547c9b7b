"""How good forecasts are."""

import numpy as np

from learning.evaluation.forecaster import LEAST
from learning.plays import Answers
from policies import Floats


def losses(chance: Floats, liked: Answers) -> Floats:
    """Return (P,): the log loss of each forecast, in nats.

    Args:
        chance: (P,) of a like.
        liked: (P,) 1: it was liked; 0: it was not.
    """
    happened = np.where(liked == 1, chance, 1.0 - chance)
    loss: Floats = -np.log(np.clip(happened, LEAST, 1.0 - LEAST))
    return loss


def squares(chance: Floats, liked: Answers) -> Floats:
    """Return (P,): the Brier score of each forecast; see `losses`."""
    return np.square(chance - liked)


def auc(chance: Floats, liked: Answers) -> float:
    """Return the chance that a like was forecast higher than a play not liked.

    Equal forecasts count half. NaN if all plays were liked, or none.
    """
    _, place = np.unique(chance, return_inverse=True)
    others = np.bincount(place[liked == 0], minlength=place.max(initial=-1) + 1)
    below = others.cumsum() - others / 2
    likes = np.count_nonzero(liked)
    pairs = likes * (len(liked) - likes)
    return float(below[place[liked == 1]].sum() / pairs) if pairs else float("nan")
