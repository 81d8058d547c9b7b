"""How sure a learned chain is: learned again from users drawn with replacement."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from learning.bootstrap import TAILS, often
from learning.chain import Chain
from learning.em import Climb, Learned, Spread, Terms
from learning.maximization import Smoothing
from learning.streams import Streams
from policies import Floats

STEPS, TOLERANCE = 100, 1e-7  # with less, what is learned again stays too near


@dataclass(frozen=True, slots=True, eq=False)
class Intervals:
    """95 % intervals of a chain's parameters, by resampling users.

    Attributes:
        low: lower ends, in the form of a chain.
        high: upper ends.
    """

    low: Chain
    high: Chain


def intervals(
    streams: Streams,
    learned: Learned,
    reward: Floats,
    smoothing: Smoothing,
    *,
    draws: int = 40,
    seed: int = 0,
    spread: Spread = map,
) -> Intervals:
    """Learn again, from the chain that was learned, with users drawn anew.

    Args:
        streams: what was seen.
        learned: from it.
        reward: (K,) worth of each signal.
        smoothing: what was imagined beside it.
        draws: how many.
        seed: of the draws.
        spread: how the work is spread.
    """
    users, parts = np.unique(streams.user), streams.parts()
    found: list[Chain] = []
    for drawn in often(len(users), draws, seed):
        times = np.zeros(users[-1] + 1, dtype=np.int64)
        times[users] = drawn
        terms = Terms(smoothing, often=times)
        found.append(again(parts, learned.chain, terms, reward, spread))
    return Intervals(*(_quantile(found, share) for share in TAILS))


def again(
    parts: Sequence[Streams],
    first: Chain,
    terms: Terms,
    reward: Floats,
    spread: Spread = map,
) -> Chain:
    """Learn again from a chain that is near.

    Args:
        parts: what was seen.
        first: the chain to begin with.
        terms: how often each user counts, and the rest.
        reward: (K,) worth of each signal.
        spread: how the work is spread.
    """
    climb = Climb(parts, first, terms, spread)
    climb.on(STEPS, TOLERANCE)
    return climb.chain.ordered(reward, climb.counts)


def _quantile(chains: Sequence[Chain], share: float) -> Chain:
    play, rest, observe, prior = (
        np.quantile([getattr(chain, name) for chain in chains], share, axis=0)
        for name in ("play", "rest", "observe", "prior")
    )
    return Chain(play, rest, observe, prior, chains[0].in_time)
