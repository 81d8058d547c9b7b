"""One listener who is met slot by slot, by whom nobody simulates: a learner, say.

Many are simulated faster together: see `runs`.
"""

from dataclasses import dataclass

import numpy as np

from policies import (
    NEVER,
    NONE,
    Floats,
    Ints,
    ModelSet,
    MoodState,
    Situation,
    answered,
    as_ints,
    expected_like,
    rested,
)
from simulation.listeners import Listeners, Truth


@dataclass(frozen=True, slots=True, eq=False)
class Listening:
    """A listener at the beginning of a slot.

    Attributes:
        truth: of the listener.
        situation: what a policy knows: N items, each a group of its own.
        last: (N,) signal of the last play of each, NONE if there was none.
        law: (N, S) distribution of the hidden states, by all that has happened, to one
            who knows the true models and the true start.
        state: (N,) the hidden states.
        felt: what the true mood follows from.
        resumed: whether the next play truly comes after a pause.
    """

    truth: Truth
    situation: Situation
    last: Ints
    law: Floats
    state: Ints
    felt: MoodState
    resumed: bool

    @property
    def mood(self) -> int:
        """Class of the true mood of the next play."""
        return self.truth.models.mood_class(self.felt, self.resumed)

    @property
    def expected(self) -> Floats:
        """(N,): the reward to be expected of each item, by `law`."""
        model = self.situation.model
        return expected_like(self.truth.models, model, self.law, self.mood)

    def reward(self, item: int, signal: int) -> float:
        """Return what a play earns that is answered with a signal."""
        if self.truth.clicks:
            m = self.situation.model[item]
            return float(self.truth.models.reward[m, signal])
        return float(self.expected[item])

    def answer(self, item: int, rng: np.random.Generator) -> int:
        """Draw the signal of an item that is played."""
        models, m = self.truth.models, self.situation.model[item]
        row = m * models.classes + self.mood
        chances = models.observe_in[row, : models.signals[m], self.state[item]]
        return int(_drawn(chances[None], rng)[0])

    def after(self, item: int, signal: int, rng: np.random.Generator) -> "Listening":
        """Return the listener after a slot: one item was played, the others rested."""
        now, true = self.situation, self.truth.models
        m = int(now.model[item])
        since = now.rested + (now.rested != NEVER)
        since[item] = 0
        last = self.last.copy()
        last[item] = signal
        chances = true.rest[now.model, self.state]
        chances[item] = true.play[m, self.state[item]]
        belief = _after(now.models, now.model, now.belief, item, signal, now.mood_class)
        mood = now.models.mood_after(now.mood, now.models.liked(m, signal))
        return Listening(
            self.truth,
            Situation(now.models, now.model, belief, now.count, since, mood=mood),
            last,
            _after(true, now.model, self.law, item, signal, self.mood)
            if self.truth.apart
            else belief,
            _drawn(chances, rng),
            true.mood_after(self.felt, true.liked(m, signal)),
            resumed=False,
        )


def begun(
    start: Situation, listeners: Listeners, rng: np.random.Generator
) -> Listening:
    """Return a new listener, whose hidden states are drawn.

    Args:
        start: items of a group follow one another.
        listeners: what is true of them.
        rng: of the hidden states.
    """
    rows = np.repeat(np.arange(len(start.model)), start.count)
    truth, belief = listeners.truth(start), start.belief[rows]
    law = listeners.belief[rows] if truth.apart else belief
    one, never = np.ones_like(rows), np.full_like(rows, NONE)
    items = Situation(
        start.models,
        start.model[rows],
        belief,
        one,
        start.rested[rows],
        mood=start.mood,
        resumed=start.resumed,
    )
    state = _drawn(law, rng)
    felt, resumed = listeners.mood, listeners.resumed
    return Listening(truth, items, never, law, state, felt, resumed)


def _after(
    models: ModelSet, model: Ints, belief: Floats, item: int, signal: int, mood: int
) -> Floats:
    """Return all beliefs after a slot; see `Listening.after`."""
    after = rested(models, model, belief, np.ones_like(model))
    m = int(model[item])
    after[item] = answered(models, m, belief[item], signal, mood).belief
    return after


def _drawn(chances: Floats, rng: np.random.Generator) -> Ints:
    """Draw a column for each row of chances (K, S).

    Only one of positive chance, whatever rounding makes of the sum.
    """
    upto = chances.cumsum(axis=1)
    drawn = rng.random((len(chances), 1)) * upto[:, -1:]
    return as_ints((upto <= drawn).sum(axis=1))
