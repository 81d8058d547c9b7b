"""Scoring items by the advantage of playing them, at the price of the situation."""

from functools import partial

from policies.arrays import Floats, Ints
from policies.compiled import compiled
from policies.index import values
from policies.policy import Scorer
from policies.relaxation import Relaxation, least, priced_advantage
from policies.situation import Situation


def by_advantage(relaxation: Relaxation) -> Scorer:
    """Score items by the advantage at the price at which the bound is least."""
    return partial(_scored, relaxation)


def _scored(relaxation: Relaxation, situation: Situation, _seed: int) -> Floats:
    return _scores(
        relaxation,
        situation.model,
        situation.belief,
        situation.count,
        situation.slate.plays,
    )


@compiled
def _scores(
    relaxation: Relaxation, model: Ints, belief: Floats, count: Ints, plays: int
) -> Floats:
    price = least(relaxation, model, belief, count, plays).price
    return values(priced_advantage(relaxation, price), 0, model, belief)
