"""A log of plays, in columns."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from policies import Floats, Ints

NONE = -1  # an answer that never came
LIKED = 0.5  # least reward of an answer that counts as a like

Answers = NDArray[np.int8]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Plays:
    """P plays, user by user, each user's in their order.

    An arm is what has a chain of its own: an item, or a group of items that are played
    and rest together (an artist).

    Attributes:
        user: (P,) row of `users`, ascending.
        arm: (P,) row of `arms`.
        answer: (P,) number of the signal, or NONE.
        seconds: (P,) when the play began, ascending within each user, from any origin;
            or None: only the order is known.
        propensity: (P,) chance with which the arm was chosen, NaN: not known; or None.
        users: U names.
        arms: A names.
        signals: K names.
        reward: (K,) in [0, 1], worth of each signal.
        slots: (P,) in which plays took place, ascending within each user, where one
            slot may hold several; None: each play is a slot.
    """

    user: Ints
    arm: Ints
    answer: Answers
    seconds: Floats | None
    propensity: Floats | None
    users: Sequence[str]
    arms: Sequence[str]
    signals: Sequence[str] = ("skip", "like")
    reward: tuple[float, ...] = (0.0, 1.0)
    slots: Ints | None = None

    def __len__(self) -> int:
        """Return P."""
        return len(self.user)

    @property
    def first(self) -> Ints:
        """Return (U + 1,): where each user's plays begin, and P."""
        return np.searchsorted(self.user, np.arange(len(self.users) + 1))

    @property
    def slot(self) -> Ints:
        """Return (P,): the slot in which each play took place, from 0."""
        return self.number if self.slots is None else self.slots

    @property
    def number(self) -> Ints:
        """Return (P,): how many plays the user had before."""
        return np.arange(len(self)) - self.first[self.user]

    @property
    def liked(self) -> Answers:
        """Return (P,): 1 for a like, 0 for another answer, NONE."""
        liked = (np.asarray(self.reward) >= LIKED).astype(np.int8)
        return np.where(self.answer == NONE, np.int8(NONE), liked[self.answer])

    def of(self, rows: Bools) -> "Plays":
        """Return some of the plays. Users and arms keep their numbers."""
        return replace(
            self,
            user=self.user[rows],
            arm=self.arm[rows],
            answer=self.answer[rows],
            seconds=None if self.seconds is None else self.seconds[rows],
            propensity=None if self.propensity is None else self.propensity[rows],
            slots=self.slot[rows],
        )

    def by_clock(self, slot_s: float) -> "Plays":
        """Return the plays in slots that follow a clock, from each user's first play.

        A slot lasts so many seconds, or until the next play. Plays that shared a slot
        still do.

        Raises:
            ValueError: the log knows no times.
        """
        if self.seconds is None:
            raise ValueError("slots by the clock need the time of each play")
        first, slot = self.first[:-1], self.slot
        fresh = np.ones(len(self), dtype=np.int64)
        fresh[1:] = slot[1:] != slot[:-1]
        fresh[first[first < len(self)]] = 1
        count = np.cumsum(fresh)
        begun = np.maximum.accumulate(np.where(fresh, np.arange(len(self)), 0))
        since = self.seconds[begun] - self.seconds[first[self.user]]
        ahead = np.floor(since / slot_s).astype(np.int64) - count
        apart = self.user * (int(np.ptp(ahead)) + 1)  # no user's slots push another's
        slots = np.maximum.accumulate(ahead + apart) - apart + count
        return replace(self, slots=slots - slots[first[self.user]])

    def earliest(self, share: float) -> Bools:
        """Return (P,): whether a play is among the first share of its user's.

        Of a user with n plays these are the first floor(share * n).
        """
        counts = np.diff(self.first)
        return self.number < np.floor(share * counts).astype(np.int64)[self.user]

    @property
    def repeated(self) -> Bools:
        """Return (P,): whether its user was played the arm before."""
        pair = self.user * len(self.arms) + self.arm
        _, firsts = np.unique(pair, return_index=True)
        repeated = np.ones(len(self), dtype=np.bool_)
        repeated[firsts] = False
        return repeated
