"""What lay before each play, in one pass over the plays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from learning.plays import NONE, Answers, Plays
from policies import Floats, Ints, as_ints
from policies.compiled import compiled

LATEST = 10  # answers that are told apart
LATEST_BITS = (1 << LATEST) - 1

Bits = NDArray[np.int16]


class Tally(NamedTuple):
    """Answers that came before each of P plays.

    Attributes:
        answers: (P,) how many.
        likes: (P,) how many of them were likes.
        bits: (P,) the latest, a like as 1, the latest of all as the lowest bit.
    """

    answers: Ints
    likes: Ints
    bits: Bits

    def latest(self, back: int) -> Floats:
        """Return (P,): 1 for a like, -1 for another answer, 0: none, so far back.

        Args:
            back: 0 for the latest answer, at most LATEST - 1.
        """
        signs = 2.0 * (self.bits >> back & 1) - 1.0
        return np.where(self.answers > back, signs, 0.0)

    def latest_likes(self) -> tuple[Floats, Floats]:
        """Return (P,): likes among the latest answers; (P,): how many these are."""
        likes = np.bitwise_count(self.bits).astype(np.float64)
        return likes, np.minimum(self.answers, LATEST).astype(np.float64)


def before(plays: Plays, kind: Ints | None = None, kinds: int = 1) -> Ints:
    """Return (P,): the row of the user's last play before of the same kind, or -1.

    Args:
        plays: P plays.
        kind: (P,) from 0; None: all are of one.
        kinds: how many there are.
    """
    alike = np.zeros(len(plays), dtype=np.int64) if kind is None else as_ints(kind)
    return _before(as_ints(plays.user), alike, as_ints(plays.first), kinds)


def tally(previous: Ints, liked: Answers) -> Tally:
    """Return the answers to all plays that `previous` leads back to.

    Args:
        previous: (P,) see `before`.
        liked: (P,) see `Plays.liked`.
    """
    return Tally(*_tally(previous, liked))


def faded(previous: Ints, liked: Answers, decay: float) -> tuple[Floats, Floats]:
    """Return (P,) likes and (P,) answers before, each worth `decay` of the next."""
    return _faded(previous, liked, decay)


@compiled
def _before(user: Ints, kind: Ints, first: Ints, kinds: int) -> Ints:
    latest = np.full(kinds, -1)
    previous = np.empty_like(kind)
    for p in range(len(kind)):
        row = latest[kind[p]]
        previous[p] = row if row >= first[user[p]] else -1
        latest[kind[p]] = p
    return previous


@compiled
def _tally(previous: Ints, liked: Answers) -> tuple[Ints, Ints, Bits]:
    answers, likes = np.zeros_like(previous), np.zeros_like(previous)
    bits = np.zeros(len(previous), np.int16)
    for p in range(len(previous)):
        row = previous[p]
        if row < 0:
            continue
        answers[p], likes[p], bits[p] = answers[row], likes[row], bits[row]
        if liked[row] != NONE:
            answers[p] += 1
            likes[p] += liked[row]
            bits[p] = (bits[row] << 1 | liked[row]) & LATEST_BITS
    return answers, likes, bits


@compiled
def _faded(previous: Ints, liked: Answers, decay: float) -> tuple[Floats, Floats]:
    likes, answers = np.zeros(len(previous)), np.zeros(len(previous))
    for p in range(len(previous)):
        row = previous[p]
        if row < 0:
            continue
        answers[p], likes[p] = answers[row], likes[row]
        if liked[row] != NONE:
            answers[p] = decay * answers[p] + 1.0
            likes[p] = decay * likes[p] + liked[row]
    return likes, answers
