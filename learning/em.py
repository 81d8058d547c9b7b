"""Chains learned by expectation and maximization, from several beginnings.

Dempster, Laird and Rubin (1977). Steps are stretched by squared extrapolation (Varadhan
and Roland 2008), and taken back where that lowers what EM makes rise: the ln of the
likelihood and of the prior that smooths.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from operator import add
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from learning.chain import Chain, Counts
from learning.expectation import expect
from learning.maximization import (
    Bond,
    Smoothing,
    bound,
    drawn,
    log_prior,
    maximize,
    rows,
)
from learning.streams import Streams
from policies import Floats, Ints

T = TypeVar("T")
R = TypeVar("R")

LEAST = 1e-150
TRIED = 12  # E steps from each beginning, before the best goes on


class Spread(Protocol):
    """How work on several things is spread: over threads, or over machines.

    Work is sent each time; things that were given before need not be.
    """

    def __call__(self, work: Callable[[T], R], things: Iterable[T], /) -> Iterable[R]:
        """Return what the work gives, thing by thing, in their order; `map` does."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How hard to look.

    Attributes:
        starts: beginnings that are tried.
        steps: E steps from the best of them, at most.
        tolerance: rise, as a share of the whole, below which it ends.
        seed: of the beginnings.
    """

    starts: int = 6
    steps: int = 200
    tolerance: float = 1e-7
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Learned:
    """A chain, and how it was found.

    Attributes:
        chain: with states by rising like.
        counts: that it expects.
        risen: ln of likelihood and prior after each E step that was kept, in nats.
        others: what the other beginnings came to when they were left.
        settled: whether the last rise was below the tolerance.
    """

    chain: Chain
    counts: Counts
    risen: Sequence[float]
    others: Sequence[float]
    settled: bool


class Terms(NamedTuple):
    """On what terms a chain is learned.

    Attributes:
        smoothing: what is imagined beside what was seen.
        bond: what is not to be learned.
        often: (U,) how often each user counts; None: once.
    """

    smoothing: Smoothing
    bond: Bond = Bond.NONE
    often: Ints | Floats | None = None


class Climb:
    """One way up, from a chain to ever likelier ones."""

    def __init__(
        self, parts: Sequence[Streams], chain: Chain, terms: Terms, spread: Spread
    ) -> None:
        """Begin at a chain."""
        self._parts = parts
        self._terms = terms
        self._spread = spread
        self.chain = bound(chain, terms.bond)
        self.counts, self.height = self._at(self.chain)
        self.risen = [self.height]

    def on(self, steps: int, tolerance: float) -> bool:
        """Go on for some E steps; say whether the last rise was below the tolerance."""
        until = len(self.risen) + steps
        while len(self.risen) < until:
            before = self.height
            self._stretch(self._step(), self._step())
            if self.height - before < tolerance * abs(self.height):
                return True
        return False

    def _at(self, chain: Chain) -> tuple[Counts, float]:
        work = partial(_expected, chain=chain, often=self._terms.often)
        found = reduce(add, self._spread(work, self._parts))
        return found, found.likelihood + log_prior(chain, self._terms.smoothing)

    def _step(self) -> Chain:
        """Take one plain step of EM; return where it began."""
        before = self.chain
        self.chain = maximize(
            self.counts, before, self._terms.smoothing, self._terms.bond
        )
        self.counts, self.height = self._at(self.chain)
        self.risen.append(self.height)
        return before

    def _stretch(self, first: Chain, second: Chain) -> None:
        """Go further the way of the last two steps, unless that leads down."""
        third = self.chain
        further = stretched(first, second, third)
        counts, height = self._at(further)
        if height > self.height:
            self.chain, self.counts, self.height = further, counts, height
        self.risen.append(self.height)


def _expected(streams: Streams, chain: Chain, often: Ints | Floats | None) -> Counts:
    weighed = streams if often is None else streams.weighing(often[streams.user])
    return expect(weighed, chain)


def stretched(first: Chain, second: Chain, third: Chain) -> Chain:
    """Extrapolate two steps of EM, in logarithms, which stay chances."""
    one, two, three = (_logarithms(chain) for chain in (first, second, third))
    step = two - one
    bend = (three - two) - step
    length = float(np.linalg.norm(step) / max(float(np.linalg.norm(bend)), LEAST))
    length = min(max(length, 1.0), 1e3)
    return _chain_of(one + 2 * length * step + length**2 * bend, third)


def _logarithms(chain: Chain) -> Floats:
    parts = (chain.play, _positive(chain), chain.observe, chain.prior)
    return np.concatenate([np.log(part).ravel() for part in parts])


def _positive(chain: Chain) -> Floats:
    """Return moves by rest, or rates with ones on their diagonal."""
    if not chain.in_time:
        return chain.rest
    return np.where(np.eye(len(chain.rest), dtype=np.bool_), 1.0, chain.rest)


def _chain_of(logarithms: Floats, like: Chain) -> Chain:
    parts = (like.play, like.rest, like.observe, like.prior)
    cuts = np.cumsum([part.size for part in parts])[:-1]
    bounded = np.exp(np.clip(logarithms, -60.0, 30.0))
    play, rest, observe, prior = (
        part.reshape(shape.shape)
        for part, shape in zip(np.split(bounded, cuts), parts, strict=True)
    )
    if like.in_time:
        np.fill_diagonal(rest, 0.0)
        rest = rest - np.diag(rest.sum(axis=1))
    else:
        rest = rows(rest)
    return Chain(rows(play), rest, rows(observe), rows(prior), like.in_time)


def learn(
    streams: Streams,
    beginnings: Sequence[Chain],
    reward: Floats,
    effort: Effort,
    terms: Terms,
    spread: Spread = map,
) -> Learned:
    """Learn a chain.

    Args:
        streams: what was seen.
        beginnings: chains to start from.
        reward: (K,) worth of each signal.
        effort: how hard to look.
        terms: see there.
        spread: how the work is spread.
    """
    parts = streams.parts()
    climbs = [Climb(parts, chain, terms, spread) for chain in beginnings]
    if len(climbs) > 1:
        for climb in climbs:
            climb.on(TRIED, 0.0)
        climbs.sort(key=lambda climb: -climb.height)
    best, *others = climbs
    settled = best.on(effort.steps, effort.tolerance)
    return Learned(
        best.chain.ordered(reward, best.counts),
        best.counts,
        best.risen,
        [other.height for other in others],
        settled,
    )


def beginnings(
    size: int,
    rate: float,
    effort: Effort,
    *,
    moods: int = 1,
    signals: int = 2,
    in_time: bool = False,
) -> Sequence[Chain]:
    """Draw the chains to start from."""
    rng = np.random.default_rng(effort.seed)
    return [
        drawn(size, rate, rng, moods=moods, signals=signals, in_time=in_time)
        for _ in range(effort.starts)
    ]
