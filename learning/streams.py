"""Plays, arm by arm: what a chain of one user and one arm lived through."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from learning.plays import Bools, Plays
from policies import Floats, Ints

FINE = 512  # lengths of rest in time are kept to this part of themselves
PARTS = 8  # at least
PART = 1 << 17  # plays of a part, of a log that has many


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Streams:
    """N streams of P plays in all: the plays of one arm to one user, in their order.

    Attributes:
        first: (N + 1,) where each stream begins among the plays, and P.
        user: (N,) rows.
        arm: (N,) rows.
        answer: (P,) number of the signal, or NONE.
        mood: (P,) class of the user's mood at the play.
        rest: (P,) row of `lengths`: the rest before the play, since the move of the
            stream's play before, or since the user's first play of any arm.
        lengths: (D,) of rests, ascending: slots, or seconds.
        row: (P,) of each play in the log.
        weight: (N,) how often each stream counts.
    """

    first: Ints
    user: Ints
    arm: Ints
    answer: Ints
    mood: Ints
    rest: Ints
    lengths: Floats
    row: Ints
    weight: Floats

    def __len__(self) -> int:
        """Return N."""
        return len(self.user)

    def parts(self, most: int = 0) -> Sequence["Streams"]:
        """Return them in parts of whole users, about as long.

        Args:
            most: how many at most; 0: as many as the log is long enough for. That does
                not follow from the machine, so sums over parts do not, either.
        """
        most = most or max(PARTS, len(self.row) // PART)
        firsts = self.first[np.flatnonzero(np.diff(self.user, prepend=-1))]
        plays = self.first[-1]
        cuts = firsts[
            np.searchsorted(firsts, np.linspace(0, plays, most + 1)[1:-1]).clip(
                max=len(firsts) - 1
            )
        ]
        bounds = np.unique([0, *np.searchsorted(self.first, cuts), len(self)])
        return [self._between(*ends) for ends in pairwise(bounds.tolist())]

    def of(self, kept: Bools) -> "Streams":
        """Return some of the streams, (N,)."""
        plays = np.repeat(kept, np.diff(self.first))
        lengths = np.diff(self.first)[kept]
        return self._of(kept, plays, np.append(0, np.cumsum(lengths)))

    def _between(self, begin: int, end: int) -> "Streams":
        """Return those from one to before another."""
        first = self.first[begin : end + 1]
        return self._of(slice(begin, end), slice(first[0], first[-1]), first - first[0])

    def _of(self, kept: Bools | slice, plays: Bools | slice, first: Ints) -> "Streams":
        used, rest = np.unique(self.rest[plays], return_inverse=True)
        return Streams(
            first,
            self.user[kept],
            self.arm[kept],
            self.answer[plays],
            self.mood[plays],
            rest.astype(np.int64),
            self.lengths[used],
            self.row[plays],
            self.weight[kept],
        )

    def weighing(self, weight: Floats | Ints) -> "Streams":
        """Return them, each counting so many times as often, (N,)."""
        return replace(self, weight=self.weight * weight)


def streams(
    plays: Plays, mood: Ints | None = None, *, in_time: bool = False
) -> Streams:
    """Return plays by user and arm.

    Args:
        plays: the log.
        mood: (P,) class of mood at each play; None: one class for all.
        in_time: whether rests are measured in seconds, not in slots.
    """
    pair = plays.user * len(plays.arms) + plays.arm
    row = np.argsort(pair, kind="stable")
    ordered = pair[row]
    begins = np.flatnonzero(np.diff(ordered, prepend=-1))
    first = np.append(begins, len(row))
    when = _when(plays, in_time=in_time)[row]
    before = np.empty_like(when)
    before[1:] = when[:-1] + (0.0 if in_time else 1.0)  # a play is a slot
    before[begins] = 0.0
    passed = when - before
    lengths, rest = np.unique(
        _rounded(passed) if in_time else passed, return_inverse=True
    )
    return Streams(
        first,
        plays.user[row[begins]],
        plays.arm[row[begins]],
        plays.answer[row].astype(np.int64),
        np.zeros(len(row), dtype=np.int64) if mood is None else mood[row],
        rest.astype(np.int64),
        lengths,
        row,
        np.ones(len(begins)),
    )


def _when(plays: Plays, *, in_time: bool) -> Floats:
    """Return (P,): slots or seconds since each user's first play."""
    if not in_time:
        return plays.slot.astype(np.float64)
    if plays.seconds is None:
        raise ValueError("rests in time need the time of each play")
    return plays.seconds - plays.seconds[plays.first[:-1]][plays.user]


def _rounded(seconds: Floats) -> Floats:
    steps = np.exp2(np.floor(np.log2(np.maximum(seconds, 1.0)))) / FINE
    rounded: Floats = np.round(seconds / steps) * steps
    return rounded
