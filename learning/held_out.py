"""Plays that are held out from learning, to judge by them what was learned."""

from dataclasses import dataclass

import numpy as np

from learning.plays import Bools, Plays

INSTANT = 1e-6  # seconds that two moments are apart, at least


@dataclass(frozen=True, slots=True, eq=False)
class Split:
    """Earlier plays, to learn from, and later ones, to judge by.

    Attributes:
        learned: (P,) whether a play is to learn from.
        until: seconds, from the log's origin, from which on no play is; None: the log
            knows no times.
    """

    learned: Bools
    until: float | None


def latest_apart(plays: Plays, share: float) -> Split:
    """Hold out the latest plays.

    Of a log with times these are all users' plays from one moment on, so that nothing
    is learned from what came later; else the last ones of each user.

    Args:
        plays: the log, of P >= 1.
        share: of all plays that are held out, in [0, 1).
    """
    if plays.seconds is None:
        return Split(plays.earliest(1.0 - share), None)
    kept = round((1.0 - share) * len(plays))
    until = (
        float(np.partition(plays.seconds, kept)[kept])
        if kept < len(plays)
        else float(plays.seconds.max()) + INSTANT
    )
    return Split(plays.seconds < until, until)
