"""Scoring items by the advantage of playing them, at the price of the situation."""

from functools import partial

from policies.arrays import Floats, Ints
from policies.compiled import compiled
from policies.index import values
from policies.lift import lifted
from policies.policy import Scorer
from policies.relaxation import Relaxation, least_of, priced_advantage
from policies.situation import Situation


def by_advantage(relaxation: Relaxation) -> Scorer:
    """Score items by the advantage at the price at which the bound is least.

    Of models with moods, that is the bound of the mean mood, and so none.
    """
    return partial(_scored, relaxation)


def _scored(relaxation: Relaxation, situation: Situation, _seed: int) -> Floats:
    price = least_of(relaxation, situation).price
    found = _advantages(relaxation, price, situation.model, situation.belief)
    return lifted(found, situation)


@compiled
def _advantages(
    relaxation: Relaxation, price: float, model: Ints, belief: Floats
) -> Floats:
    return values(priced_advantage(relaxation, price), 0, model, belief)
