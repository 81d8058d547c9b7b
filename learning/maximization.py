"""The M step: the chain that makes expected counts most likely."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from learning.chain import Chain, Counts
from policies import Floats

SECONDS = 86_400.0  # of rest that are imagined with each imagined move
STILL = 1e-6  # chance of a move where interest hardly moves
SLOT_S = 300.0  # of a slot, where chains in time begin
SPREAD = 2.5  # of the log-odds of a like at first, from the mean to either end


@dataclass(frozen=True, slots=True)
class Smoothing:
    """What is imagined beside what was seen: Dirichlet and Beta priors, less one.

    Attributes:
        moves: of each move by a play or a rest.
        observe: of each signal in each state and mood.
        prior: of each first state.
    """

    moves: float = 0.5
    observe: float = 1.0
    prior: float = 0.5


class Bond(StrEnum):
    """What a chain may not learn, to see what a log tells of it.

    NONE: it learns everything
    REST: interest hardly moves while an item rests
    PLAY: it hardly moves by a play
    SAME: it moves by a rest as by a play; in slots alone
    """

    NONE = "none"
    REST = "rest"
    PLAY = "play"
    SAME = "same"


def bound(chain: Chain, bond: Bond) -> Chain:
    """Return a chain that keeps to a bond, to begin with."""
    size = len(chain.prior)
    still = (1 - STILL) * np.eye(size) + STILL / size
    if bond is Bond.REST and chain.in_time:
        still = (still - np.eye(size)) / SLOT_S
    if bond is Bond.REST:
        return replace(chain, rest=still)
    if bond is Bond.PLAY:
        return replace(chain, play=still)
    return replace(chain, rest=chain.play) if bond is Bond.SAME else chain


def maximize(
    counts: Counts, chain: Chain, smoothing: Smoothing, bond: Bond = Bond.NONE
) -> Chain:
    """Return the chain of the greatest posterior density, given such counts.

    Args:
        counts: expected.
        chain: that expects them.
        smoothing: what is imagined beside them.
        bond: what stays as it is.
    """
    play, rest = chain.play, chain.rest
    if bond is Bond.SAME:
        play = rest = rows(counts.play + counts.rest + 2 * smoothing.moves)
    if bond in {Bond.NONE, Bond.REST}:
        play = rows(counts.play + smoothing.moves)
    if bond in {Bond.NONE, Bond.PLAY} and chain.in_time:
        rest = _generator(counts.rest, smoothing.moves)
    elif bond in {Bond.NONE, Bond.PLAY}:
        rest = rows(counts.rest + smoothing.moves)
    return Chain(
        play,
        rest,
        rows(counts.observe + smoothing.observe),
        rows(counts.prior + smoothing.prior),
        chain.in_time,
    )


def log_prior(chain: Chain, smoothing: Smoothing) -> float:
    """Return the ln of the prior density, but for a constant: EM makes it rise too."""
    total = smoothing.moves * np.log(chain.play).sum()
    if chain.in_time:
        rates = chain.rest[~np.eye(len(chain.rest), dtype=np.bool_)]
        total += smoothing.moves * (np.log(rates) - SECONDS * rates).sum()
    else:
        total += smoothing.moves * np.log(chain.rest).sum()
    total += smoothing.observe * np.log(chain.observe).sum()
    return float(total + smoothing.prior * np.log(chain.prior).sum())


def rows(counts: Floats) -> Floats:
    """Return counts as shares of their row."""
    shares: Floats = counts / counts.sum(axis=-1, keepdims=True)
    return shares


def _generator(moves: Floats, smoothing: float) -> Floats:
    """Return jumps a second; `moves` has the seconds on its diagonal."""
    size = len(moves)
    spent = np.diagonal(moves) + smoothing * SECONDS * (size > 1)
    rates = (moves + smoothing) / spent[:, None]
    np.fill_diagonal(rates, 0.0)
    return _closed(rates)


def _closed(rates: Floats) -> Floats:
    """Return rates with the diagonal that makes rows sum to zero."""
    generator: Floats = rates - np.diag(rates.sum(axis=1))
    return generator


def drawn(
    size: int,
    rate: float,
    rng: np.random.Generator,
    *,
    moods: int = 1,
    signals: int = 2,
    in_time: bool = False,
) -> Chain:
    """Draw a chain to begin with: near the identity, interest that hardly moves.

    Args:
        size: S.
        rate: of likes, or of the last signal.
        rng: for all draws.
        moods: M.
        signals: K.
        in_time: whether rests are measured in seconds.
    """
    leave, slow = 10 ** rng.uniform(-3.0, -1.3), 10 ** rng.uniform(-5.0, -3.0)
    play = (1 - leave) * np.eye(size) + leave * rng.dirichlet(np.ones(size), size)
    toward = rng.dirichlet(np.ones(size), size)
    rest = (1 - slow) * np.eye(size) + slow * toward
    if in_time:
        toward = toward * slow / SLOT_S
        np.fill_diagonal(toward, 0.0)
        rest = _closed(toward)
    odds = np.linspace(-SPREAD, SPREAD, size) + rng.normal(0.0, 0.3, size)
    like = 1 / (1 + np.exp(-odds) * (1 - rate) / rate)
    worth = np.linspace(0.0, 1.0, signals)
    observe = rows(like[:, None] ** worth * (1 - like[:, None]) ** (1 - worth))
    return Chain(
        play, rest, np.tile(observe, (moods, 1, 1)), np.full(size, 1 / size), in_time
    )
