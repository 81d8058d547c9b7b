"""Chains that a log allows: draws from what is known after it.

Each draw begins with a chain that is learned again, from users who count at random
(the weighted likelihood bootstrap, Newton and Raftery 1994): about as far from the one
learned as the log allows. From there it goes on by Gibbs sampling: paths of hidden
states given the chain, and the chain given what was met along them, by turns (Scott
2002). That leads to what is known exactly, but where paths are told badly it creeps:
so the beginning counts, and how far it is remembered is told. What is known before the
log is what smooths where chains are learned: Dirichlet, with one more than is imagined
of each kind.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from learning.bridges import halved, moves_within
from learning.chain import Chain
from learning.em import Spread, Terms
from learning.maximization import Smoothing
from learning.passes import Seen, Steps
from learning.paths import Drawn, draw
from learning.resampling import again
from learning.rests import moves_of
from learning.streams import Streams
from policies import Floats, Ints


@dataclass(frozen=True, slots=True)
class Sampling:
    """How chains are drawn.

    Attributes:
        kept: draws.
        sweeps: of paths and chains by turns, for each of them.
        seed: of all random numbers.
    """

    kept: int = 16
    sweeps: int = 50
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Independent draws, and how they came about.

    Attributes:
        chains: D of them, each with states by rising like.
        begun: D, the chains that these began with.
    """

    chains: Sequence[Chain]
    begun: Sequence[Chain]

    def remembered(self, reward: Floats) -> float:
        """Return how far draws still follow their beginnings, from 0 to 1.

        The mean correlation of both, over what is known of a chain; of few draws it is
        known badly.

        Args:
            reward: (K,) worth of each signal.
        """
        ends, begins = (
            np.array([_quantities(chain, reward) for chain in chains])
            for chains in (self.chains, self.begun)
        )
        ends, begins = ends - ends.mean(axis=0), begins - begins.mean(axis=0)
        both = np.sqrt((ends**2).sum(axis=0) * (begins**2).sum(axis=0))
        told = (ends * begins).sum(axis=0)[both > 0] / both[both > 0]
        return float(np.clip(told.mean(), 0.0, 1.0)) if len(told) else 1.0


def sample(
    streams: Streams,
    first: Chain,
    reward: Floats,
    smoothing: Smoothing,
    sampling: Sampling,
    spread: Spread = map,
    tell: Callable[[], object] = lambda: None,
) -> Posterior:
    """Draw chains.

    Those that rest by the clock stay as they begin: their paths are not drawn.

    Args:
        streams: what was seen.
        first: the chain that was learned.
        reward: (K,) worth of each signal.
        smoothing: what is imagined beside what was seen.
        sampling: how.
        spread: how the work is spread.
        tell: called after each draw.
    """
    parts = streams.parts()
    lengths = halved(streams.lengths.astype(np.int64))
    users = int(streams.user.max(initial=-1)) + 1
    begun, found = list[Chain](), list[Chain]()
    for seed in np.random.SeedSequence(sampling.seed).spawn(sampling.kept):
        rng = np.random.default_rng(seed)
        terms = Terms(smoothing, often=rng.standard_exponential(users))
        chain = again(parts, first, terms, reward, spread)
        begun.append(_ordered(chain, reward))
        for _ in range(0 if first.in_time else sampling.sweeps):
            drawn = _counted(parts, lengths, chain, rng, spread)
            chain = _chain(drawn, lengths, chain, smoothing, rng)
        found.append(_ordered(chain, reward))
        tell()
    return Posterior(found, begun)


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
        chain.play[ways],
        chain.rest[ways],
        chain.observe[:, by],
        chain.prior[by],
        chain.in_time,
    )


def _quantities(chain: Chain, reward: Floats) -> Floats:
    """Return what is known of a chain."""
    like = (chain.observe @ reward).ravel()
    stays = [np.diagonal(moves) for moves in (chain.play, chain.rest)]
    return np.concatenate((like, *stays, chain.prior))
