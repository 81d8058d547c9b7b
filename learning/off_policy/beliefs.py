"""What was believed of a user along a log, as the service believes."""

from dataclasses import dataclass

import numpy as np

from learning.off_policy.catalogue import Catalogue
from learning.plays import NONE, Bools
from policies import (
    NEUTRAL,
    REMEMBERED,
    Floats,
    Ints,
    MoodState,
    answered,
    rested,
    returned,
    untouched,
)


@dataclass(frozen=True, slots=True, eq=False)
class Beliefs:
    """A user's played arms, with their beliefs in one slot, and the user's mood.

    Attributes:
        arm: (K,) ascending.
        rested: (K,) slots since each was played.
        belief: (K, S).
        returned: (K,) whether interest has returned to that of an arm never played.
        fresh: (M, S) the belief of an arm never played, by model.
        mood: of the user, where models have one.
        resumed: whether the slot comes after a pause that makes a mood of its own.
    """

    arm: Ints
    rested: Ints
    belief: Floats
    returned: Bools
    fresh: Floats
    mood: MoodState
    resumed: bool

    @property
    def forgotten(self) -> Bools:
        """Return (K,): whether nothing tells an arm from one never played."""
        return self.returned & (self.rested >= REMEMBERED)

    def of(self, arm: int, model: int) -> Floats:
        """Return (S,): the belief of an arm of some model."""
        row = int(np.searchsorted(self.arm, arm))
        known = row < len(self.arm) and int(self.arm[row]) == arm
        belief: Floats = self.belief[row] if known else self.fresh[model]
        return belief


class Listener:
    """One user, to whom arms are played in one slot after the other."""

    def __init__(self, catalogue: Catalogue, arms: Ints) -> None:
        """Begin with a new user.

        Args:
            catalogue: that arms are of.
            arms: (N,) that will be played, ascending.
        """
        self._catalogue = catalogue
        self._arms = arms
        self._slot = np.full(len(arms), NONE)  # from which a belief is; NONE: untouched
        self._belief = np.empty((len(arms), catalogue.models.prior.shape[1]))
        self._mood = NEUTRAL

    def beliefs(self, slot: int, waited_s: float | None = None) -> Beliefs:
        """Return what is believed in a slot, not before that of the last play.

        Args:
            slot: where the user is.
            waited_s: seconds since the last slot began; None: there was none, or nobody
                knows.
        """
        played = np.flatnonzero(self._slot != NONE)
        models, model = self._catalogue.models, self._catalogue.model
        arm = self._arms[played]
        passed = np.maximum(slot - self._slot[played], 0)
        belief = rested(models, model[arm], self._belief[played], passed)
        fresh = untouched(models, slot)
        back = returned(belief, fresh[model[arm]])
        resumed = models.resumed(waited_s)
        return Beliefs(arm, passed, belief, back, fresh, self._mood, resumed)

    def take(self, beliefs: Beliefs, slot: int, arm: int, answer: int) -> None:
        """Learn from the answer to a play in a slot, given what was believed in it."""
        model = int(self._catalogue.model[arm])
        signal = NONE if answer == NONE else int(self._catalogue.signal[model, answer])
        before = beliefs.of(arm, model)
        row = int(np.searchsorted(self._arms, arm))
        models = self._catalogue.models
        mood = models.mood_class(beliefs.mood, beliefs.resumed)
        after = answered(models, model, before, signal, mood)
        self._mood = models.mood_after(self._mood, models.liked(model, signal))
        self._belief[row] = after.belief
        self._slot[row] = slot + 1
