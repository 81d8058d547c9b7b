"""The E step: what a chain expects to have happened, given what was seen.

Baum, Petrie, Soules and Weiss (1970), for a chain whose moves are of two kinds and
whose signals are missing while it rests. With R(d) the moves of a rest of length d, an
arm in belief f that is played and answers y has then the belief (f o b_y) P1, and
before its next play that times R(d). What happened within rests is not gone through
slot by slot: the rests' ends are added up by length, and `rests` counts inside them.
"""

import numpy as np

from learning.chain import Chain, Counts
from learning.passes import LEAST, Found, Seen, Steps, both_ways, forward
from learning.plays import NONE
from learning.rests import moves_of, within
from learning.streams import Streams
from policies import Floats


def expect(streams: Streams, chain: Chain) -> Counts:
    """Return what a chain of as many signals and moods expects to have happened."""
    found = Found(
        np.zeros_like(chain.play),
        np.zeros((len(streams.lengths), *chain.play.shape)),
        np.zeros_like(chain.observe),
        np.zeros_like(chain.prior),
        np.zeros(len(streams)),
    )
    both_ways(_seen(streams), _steps(streams, chain), streams.weight, found)
    return Counts(
        found.played * chain.play,
        within(chain, streams.lengths, found.ends),
        found.observed,
        found.begun * chain.prior,
        float(streams.weight @ found.likelihood),
    )


def chances(streams: Streams, chain: Chain) -> Floats:
    """Return (P, K): the chance of each signal before each play of the streams.

    It follows from the plays of the same stream before it, and from its mood.
    """
    found = np.empty((len(streams.row), chain.observe.shape[2]))
    forward(_seen(streams), _steps(streams, chain), found)
    return found


def likelihoods(streams: Streams, chain: Chain) -> Floats:
    """Return (N,): ln of the chance of all answers of each stream, in nats."""
    answered = streams.answer != NONE
    plays = np.arange(len(streams.row))
    given = chances(streams, chain)[plays, np.where(answered, streams.answer, 0)]
    logarithms = np.where(answered, np.log(np.maximum(given, LEAST)), 0.0)
    total: Floats = np.add.reduceat(logarithms, streams.first[:-1])
    return total


def _seen(streams: Streams) -> Seen:
    return Seen(streams.first, streams.answer, streams.mood, streams.rest)


def _steps(streams: Streams, chain: Chain) -> Steps:
    rests = moves_of(chain, streams.lengths)
    return Steps(chain.play, rests, chain.observe, chain.prior)
