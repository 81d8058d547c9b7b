"""The candidate items of one decision, grouped."""

from dataclasses import dataclass

import numpy as np

from policies.arrays import Floats, Ints
from policies.model_set import ModelSet
from policies.mood import NEUTRAL, MoodState

NEVER = 2**62


@dataclass(frozen=True, slots=True, eq=False)
class Slate:
    """What one slot holds: M plays, of which C items are chosen already.

    Attributes:
        plays: M, how many items are played in every slot.
        model: (C,) row of the model of each item chosen.
        belief: (C, S) in this slot; they are no candidates any more.
    """

    plays: int
    model: Ints
    belief: Floats


ALONE = Slate(1, np.empty(0, dtype=np.int64), np.empty((0, 0)))


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """G groups of candidates; the items of a group share model and belief.

    All items of one model that a user has never been played are one group, so a
    decision costs what the user has touched, not what the catalogue holds. Nothing is
    checked here: this is built for every decision. The arrays have to be contiguous,
    writeable, int64 or float64 (`as_ints` and `as_floats` make them so).

    Attributes:
        models: M models of S states.
        model: (G,) row of each group's model.
        belief: (G, S).
        count: (G,) items in each group, at least 1.
        rested: (G,) slots since the group's items were last played, NEVER if never.
        slate: what is played in this slot beside the item to choose.
        mood: of the user, where models have one.
        resumed: whether the play comes after a pause that makes a mood of its own.
    """

    models: ModelSet
    model: Ints
    belief: Floats
    count: Ints
    rested: Ints
    slate: Slate = ALONE
    mood: MoodState = NEUTRAL
    resumed: bool = False

    @property
    def mood_class(self) -> int:
        """Class of the mood of the next play; 0 where models have no mood."""
        if self.models.classes == 1:
            return 0
        return self.models.mood_class(self.mood, self.resumed)

    @property
    def chances(self) -> Ints:
        """(G,): row of each group's chances in that mood, in `ModelSet.like_in`."""
        if self.models.classes == 1:
            return self.model
        return self.model * self.models.classes + self.mood_class

    def check(self) -> None:
        """Check what every policy takes for granted; for tests.

        Raises:
            ValueError: names the field at fault.
        """
        groups, size = len(self.model), self.models.like.shape[1]
        if self.belief.shape != (groups, size):
            raise ValueError(f"belief: has shape {self.belief.shape}")
        if not np.allclose(self.belief.sum(axis=1), 1) or (self.belief < 0).any():
            raise ValueError("belief: a row is no distribution")
        if ((self.model < 0) | (self.model >= len(self.models.like))).any():
            raise ValueError("model: no such row")
        for name, least in (("model", 0), ("count", 1), ("rested", 0)):
            values: Ints = getattr(self, name)
            if values.shape != (groups,) or (values < least).any():
                raise ValueError(f"{name}: needs {groups} numbers from {least}")
        if not 0 <= self.mood_class < self.models.classes:
            raise ValueError("mood: is none of the models'")
        self._check_layout()

    def _check_layout(self) -> None:
        for name in ("model", "belief", "count", "rested"):
            array: Ints | Floats = getattr(self, name)
            kind = np.float64 if name == "belief" else np.int64
            if array.dtype != kind or not array.flags.carray:
                raise ValueError(f"{name}: not plain {np.dtype(kind)}")
