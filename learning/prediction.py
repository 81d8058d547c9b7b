"""What models foretell of a log, whoever made them."""

from collections.abc import Sequence

import numpy as np

from learning.chain import Chain
from learning.expectation import chances
from learning.plays import LIKED, Plays
from learning.streams import streams
from policies import Floats, Ints


def predicted(
    plays: Plays,
    chains: Sequence[Chain],
    of_arms: Ints,
    mood: Ints | None = None,
    *,
    in_time: bool = False,
) -> Floats:
    """Return (P, K): the chance of each signal before each play of a log.

    Args:
        plays: the log.
        chains: models of arms, of as many signals as the log.
        of_arms: (A,) which of them each arm follows.
        mood: (P,) class of the user's mood at each play; None: one class for all.
        in_time: whether the chains rest by the clock.
    """
    seen = streams(plays, mood, in_time=in_time)
    kind = of_arms[seen.arm]
    found = np.empty((len(plays), len(plays.signals)))
    for number, chain in enumerate(chains):
        own = kind == number
        if own.any():
            part = seen.of(own)
            found[part.row] = chances(part, chain)
    return found


def liked(plays: Plays, chances: Floats) -> Floats:
    """Return (P,): the chance of a like, of the (P, K) chances of signals."""
    likes = np.asarray(plays.reward) >= LIKED
    found: Floats = (chances @ likes).clip(0.0, 1.0)
    return found
