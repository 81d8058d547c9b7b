"""Those who listen: their hidden states, which no policy sees.

A policy believes; a listener is. Both agree where hidden states at the start follow the
beliefs and the models are right. The paper has it otherwise: its listeners begin in
fixed states, which contradict the beliefs (section "Numerical results").
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from policies import NEUTRAL, Floats, ModelSet, MoodState, Situation


class Truth(NamedTuple):
    """Listeners, as compiled code takes them.

    Attributes:
        models: M true ones.
        apart: whether it differs from what a policy believes.
        clicks: whether rewards are counted as answered, not as expected.
    """

    models: ModelSet
    apart: bool
    clicks: bool


@dataclass(frozen=True, slots=True, eq=False)
class Listeners:
    """What is true of all listeners.

    Rewards are scored in one of two ways, with the same mean. Either a play earns what
    its signal is worth (`clicks`): then a hidden state is drawn whenever an item is
    played, and the signal from it. Or it earns what was to be expected of all that had
    happened to the listener, by the exact filter of the true models and the true start;
    the signal is drawn from the same filter. That has a fraction of the variance (Rao
    and Blackwell).

    Attributes:
        models: M true ones, in the order of those that policies believe in.
        belief: (G, S) distribution of the hidden state of each group at the start.
        clicks: whether the signals given are scored, not those expected.
        mood: at the start, if the true models have one; it follows from the answers.
        resumed: whether the first play comes after a pause; the others follow at once.
    """

    models: ModelSet
    belief: Floats
    clicks: bool = False
    mood: MoodState = NEUTRAL
    resumed: bool = False

    @classmethod
    def believed(cls, start: Situation, *, clicks: bool = False) -> "Listeners":
        """Those of whom policies believe what is true."""
        return cls(start.models, start.belief, clicks, start.mood, start.resumed)

    @classmethod
    def in_states(
        cls, start: Situation, states: Sequence[int], *, clicks: bool = False
    ) -> "Listeners":
        """Those who begin in certain states, whatever is believed.

        Args:
            start: G groups of items.
            states: of each group, from 0.
            clicks: see the class.

        Raises:
            ValueError: there are not so many, or not such states.
        """
        sizes = start.models.states[start.model]
        if len(states) != len(sizes) or not all(
            0 <= state < size for state, size in zip(states, sizes, strict=True)
        ):
            raise ValueError(f"states: must be one of each group's, not {states}")
        belief = np.eye(start.belief.shape[1])[list(states)]
        return cls(start.models, belief, clicks, start.mood, start.resumed)

    def differ(self, start: Situation) -> bool:
        """Say whether they are not known to be as believed at a situation."""
        same = self.models is start.models and self.belief is start.belief
        mood = (self.mood, self.resumed) == (start.mood, start.resumed)
        return self.clicks or not (same and mood)

    def truth(self, start: Situation) -> Truth:
        """Return what is true where policies begin at a situation.

        Raises:
            ValueError: the true models do not have the shape of those believed in.
        """
        believed = start.models
        if len(self.models.signals) != len(believed.signals):
            raise ValueError("models: must be as many as those that are believed in")
        if (self.models.signals != believed.signals).any():
            raise ValueError("models: the true ones have other signals")
        shape = (len(start.model), self.models.like.shape[1])
        if self.belief.shape != shape:
            raise ValueError(f"belief: must have the shape {shape}")
        sums = self.belief.sum(axis=1)
        if not (self.belief >= 0).all() or not np.allclose(sums, 1):
            raise ValueError("belief: a row is no distribution")
        mood = self.models.mood_class(self.mood, self.resumed)
        if not 0 <= mood < self.models.classes:
            raise ValueError("mood: is none of the true models'")
        return Truth(self.models, self.differ(start), self.clicks)
