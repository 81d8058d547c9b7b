"""Chains that a log allows: draws from what is known after it.

Gibbs sampling: paths of hidden states given a chain, and a chain given what was met
along them, by turns (Scott 2002). What is known before the log is what smooths where
chains are learned: Dirichlet, with one more than is imagined of each kind. Several
chains of draws begin where expectation and maximization ended.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from learning.bridges import halved, moves_within
from learning.chain import Chain
from learning.convergence import effective, r_hat
from learning.em import Spread
from learning.maximization import Smoothing
from learning.passes import Seen, Steps
from learning.paths import Drawn, draw
from learning.rests import moves_of
from learning.streams import Streams
from policies import Floats, Ints


@dataclass(frozen=True, slots=True)
class Sampling:
    """How chains are drawn.

    Attributes:
        kept: draws that are returned.
        chains: of draws, which are shared out among them.
        warm_up: draws of each that are dropped.
        thin: of how many later ones one is kept.
        seed: of all random numbers.
    """

    kept: int = 16
    chains: int = 4
    warm_up: int = 100
    thin: int = 10
    seed: int = 0

    @property
    def each(self) -> int:
        """Return how many draws of each chain are kept."""
        return -(-self.kept // self.chains)


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Draws, and whether they are to be trusted.

    Attributes:
        chains: D of them, each with states by rising like.
        r_hat: of the quantity on which chains of draws agree least; about 1 if well.
        effective: independent draws that all of the quantity that moves slowest are
            worth.
    """

    chains: Sequence[Chain]
    r_hat: float
    effective: float


def sample(
    streams: Streams,
    first: Chain,
    reward: Floats,
    smoothing: Smoothing,
    sampling: Sampling,
    spread: Spread = map,
) -> Posterior:
    """Draw chains.

    Args:
        streams: what was seen.
        first: the chain to begin with, in slots.
        reward: (K,) worth of each signal.
        smoothing: what is imagined beside what was seen.
        sampling: how.
        spread: how the work is spread.

    Raises:
        ValueError: the chain rests by the clock.
    """
    if first.in_time:
        raise ValueError("chains that rest by the clock are not drawn")
    parts = streams.parts()
    lengths = halved(streams.lengths.astype(np.int64))
    kept, told = list[Chain](), list[Floats]()
    for seed in np.random.SeedSequence(sampling.seed).spawn(sampling.chains):
        rng, chain = np.random.default_rng(seed), first
        along: list[Chain] = []
        for _ in range(sampling.warm_up + sampling.each * sampling.thin):
            drawn = _counted(parts, lengths, chain, rng, spread)
            chain = _ordered(_chain(drawn, lengths, chain, smoothing, rng), reward)
            along.append(chain)
        later = along[sampling.warm_up :]
        kept += later[sampling.thin - 1 :: sampling.thin]
        told.append(np.array([_quantities(each, reward) for each in later]))
    by_quantity = np.stack(told).transpose(2, 0, 1)
    return Posterior(
        kept[: sampling.kept],
        float(np.max([r_hat(each) for each in by_quantity])),
        float(np.min([effective(each) for each in by_quantity])),
    )


def _counted(
    parts: Sequence[Streams],
    lengths: Ints,
    chain: Chain,
    rng: np.random.Generator,
    spread: Spread,
) -> Drawn:
    """Draw a path of each stream, and add up what was met; lengths are those halved."""
    seed = int(rng.integers(2**53))
    total = _nothing(chain, len(lengths))
    found = spread(partial(_drawn, chain=chain, seed=seed), parts)
    for part, drawn in zip(parts, found, strict=True):
        rows = np.searchsorted(lengths, part.lengths.astype(np.int64))
        total.ends[rows] += drawn.ends
        np.add(total.played, drawn.played, out=total.played)
        np.add(total.observed, drawn.observed, out=total.observed)
        np.add(total.begun, drawn.begun, out=total.begun)
    return total


def _nothing(chain: Chain, lengths: int) -> Drawn:
    size = len(chain.prior)
    return Drawn(
        np.zeros((size, size), dtype=np.int64),
        np.zeros((lengths, size, size), dtype=np.int64),
        np.zeros(chain.observe.shape, dtype=np.int64),
        np.zeros(size, dtype=np.int64),
    )


def _drawn(streams: Streams, chain: Chain, seed: int) -> Drawn:
    """Draw paths of a part; its first user tells its random numbers from others'."""
    rng = np.random.default_rng((seed, int(streams.user[0])))
    drawn = _nothing(chain, len(streams.lengths))
    seen = Seen(streams.first, streams.answer, streams.mood, streams.rest)
    rests = moves_of(chain, streams.lengths)
    steps = Steps(chain.play, rests, chain.observe, chain.prior)
    draw(seen, steps, rng.random(len(streams) + 2 * len(streams.row)), drawn)
    return drawn


def _chain(
    drawn: Drawn,
    lengths: Ints,
    before: Chain,
    smoothing: Smoothing,
    rng: np.random.Generator,
) -> Chain:
    """Draw a chain, given what was met."""
    within = moves_within(before, lengths, drawn.ends, rng)
    return Chain(
        _dirichlet(drawn.played, smoothing.moves, rng),
        _dirichlet(within, smoothing.moves, rng),
        _dirichlet(drawn.observed, smoothing.observe, rng),
        _dirichlet(drawn.begun, smoothing.prior, rng),
    )


def _dirichlet(counts: Ints, imagined: float, rng: np.random.Generator) -> Floats:
    """Draw a distribution for each row."""
    drawn = rng.standard_gamma(counts + (imagined + 1))
    shares: Floats = drawn / drawn.sum(axis=-1, keepdims=True)
    return shares


def _ordered(chain: Chain, reward: Floats) -> Chain:
    """Number states by rising like: what they are called tells nothing."""
    by = np.argsort((chain.observe @ reward).mean(axis=0), kind="stable")
    ways = np.ix_(by, by)
    return Chain(
        chain.play[ways], chain.rest[ways], chain.observe[:, by], chain.prior[by]
    )


def _quantities(chain: Chain, reward: Floats) -> Floats:
    """Return what chains of draws are compared by."""
    like = (chain.observe @ reward).ravel()
    stays = [np.diagonal(moves) for moves in (chain.play, chain.rest)]
    return np.concatenate((like, *stays, chain.prior))
