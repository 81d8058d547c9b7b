"""Item types: which chains there are, and which arm follows which.

A mixture of chains: all streams of an arm follow one chain, whoever they are of; which
one is not known. Where single arms are thin, arms of a type are learned together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial, reduce
from operator import add

import numpy as np

from learning.chain import Chain, Counts
from learning.em import Effort, Spread
from learning.expectation import expect, likelihoods
from learning.maximization import Smoothing, log_prior, maximize
from learning.plays import NONE
from learning.streams import Streams
from policies import Floats, Ints

FIRST_SHARE = 0.8  # of an arm in the type that it begins in
STRENGTH = 10.0  # plays like the mean, beside those of an arm


@dataclass(frozen=True, slots=True, eq=False)
class Types:
    """K types of A arms.

    Attributes:
        chains: K of them.
        share: (K,) of all arms.
        belongs: (A, K) chance that an arm is of a type; of an arm never seen, `share`.
        risen: ln of the likelihood and of the prior after each step.
        settled: whether the last rise was below the tolerance.
    """

    chains: Sequence[Chain]
    share: Floats
    belongs: Floats
    risen: Sequence[float] = ()
    settled: bool = True

    @property
    def of_arms(self) -> Ints:
        """Return (A,): the likeliest type of each arm."""
        return np.asarray(self.belongs.argmax(axis=1), dtype=np.int64)


def learn_types(
    streams: Streams,
    first: Chain,
    arms: int,
    types: int,
    effort: Effort,
    smoothing: Smoothing,
    spread: Spread = map,
) -> Types:
    """Learn a mixture.

    Args:
        streams: what was seen.
        first: the chain of all arms together, from which each type begins.
        arms: A.
        types: K.
        effort: how hard to look.
        smoothing: of each chain.
        spread: how the work is spread.
    """
    parts = streams.parts()
    seen = np.zeros(arms, dtype=np.bool_)
    seen[streams.arm] = True
    chains: Sequence[Chain] = [first] * types
    belongs, share = _first_types(streams, arms, types), np.full(types, 1 / types)
    risen: list[float] = []
    settled = False
    while len(risen) < effort.steps and not settled:
        counts = _counts(parts, chains, belongs, spread)
        chains = [
            maximize(each, chain, smoothing)
            for each, chain in zip(counts, chains, strict=True)
        ]
        share = belongs[seen].sum(axis=0) + 1.0
        share /= share.sum()
        told = spread(partial(_told, chains=chains, arms=arms), parts)
        joint = reduce(add, told) + np.log(share)
        either = np.logaddexp.reduce(joint, axis=1)
        belongs = np.exp(joint - either[:, None])
        assumed = sum(log_prior(each, smoothing) for each in chains)
        risen.append(float(either[seen].sum() + assumed + np.log(share).sum()))
        rise = risen[-1] - risen[-2] if len(risen) > 1 else np.inf
        settled = rise < effort.tolerance * abs(risen[-1])
    return Types(chains, share, belongs, risen, settled)


def _first_types(streams: Streams, arms: int, types: int) -> Floats:
    """Return (A, K): arms in order of their likes, cut into types of as many plays."""
    arm = np.repeat(streams.arm, np.diff(streams.first))
    answered = streams.answer != NONE
    plays = np.bincount(arm[answered], minlength=arms)
    likes = np.bincount(arm[answered], streams.answer[answered], arms)
    mean = likes.sum() / max(plays.sum(), 1)
    order = np.argsort((likes + STRENGTH * mean) / (plays + STRENGTH), kind="stable")
    passed = np.cumsum(plays[order]) - plays[order] / 2
    kind = np.minimum(types * passed // max(plays.sum(), 1), types - 1).astype(np.int64)
    belongs = np.full((arms, types), (1 - FIRST_SHARE) / max(types - 1, 1))
    belongs[order, kind] = FIRST_SHARE if types > 1 else 1.0
    return belongs


def _counts(
    parts: Sequence[Streams], chains: Sequence[Chain], belongs: Floats, spread: Spread
) -> Sequence[Counts]:
    """Return what each chain expects of the arms that belong to it."""
    found = spread(partial(_expected, chains=chains, belongs=belongs), parts)
    return [reduce(add, each) for each in zip(*found, strict=True)]


def _expected(
    streams: Streams, chains: Sequence[Chain], belongs: Floats
) -> Sequence[Counts]:
    return [
        expect(streams.weighing(belongs[streams.arm, k]), chain)
        for k, chain in enumerate(chains)
    ]


def _told(streams: Streams, chains: Sequence[Chain], arms: int) -> Floats:
    """Return (A, K): ln of the chance of an arm's answers, if it were of a type."""
    told = np.zeros((arms, len(chains)))
    for k, chain in enumerate(chains):
        found = streams.weight * likelihoods(streams, chain)
        told[:, k] = np.bincount(streams.arm, found, arms)
    return told
