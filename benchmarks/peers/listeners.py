"""Listeners with true hidden states, whose luck is drawn before anybody plays.

So every competitor meets the same listeners: of two that play the same items in the
same slots, both see the same answers.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.worlds import Chance
from policies import Floats, Ints, ModelSet

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Luck:
    """What happens to one listener in T slots, whatever is played.

    start:      (N,) state of each item in the first slot
    after_play: (T, N, S) state in the next slot by item and state, if it is played
    after_rest: (T, N, S) the same if it is not
    liked:      (T, N, S) whether a play would be liked
    """

    start: Ints
    after_play: Ints
    after_rest: Ints
    liked: Flags

    @classmethod
    def drawn(cls, models: ModelSet, slots: int, rng: Chance) -> "Luck":
        items, size = models.like.shape
        start = landed(models.prior, rng.random((items, 1)))
        moves = rng.random((slots, items, 1, 1))
        return cls(
            start,
            landed(models.play, moves),
            landed(models.rest, moves),
            rng.random((slots, items, 1)) < np.broadcast_to(models.like, (items, size)),
        )


def landed(rows: Floats, uniform: Floats) -> Ints:
    """Draw from distributions (..., S) by uniform numbers (..., 1)."""
    below = np.cumsum(rows, axis=-1)[..., :-1] <= uniform
    return np.asarray(below.sum(axis=-1))


class Listener:
    """Answers plays, and moves on by a slot with each."""

    def __init__(self, luck: Luck) -> None:
        self.luck = luck
        self.states = luck.start
        self.slot = 0
        self.items = np.arange(len(luck.start))

    def answer(self, item: int) -> bool:
        luck, slot, state = self.luck, self.slot, self.states[item]
        self.states = luck.after_rest[slot, self.items, self.states]
        self.states[item] = luck.after_play[slot, item, state]
        self.slot += 1
        return bool(luck.liked[slot, item, state])


def expected_likes(models: ModelSet, items: Ints, liked: Flags) -> Floats:
    """Return the chance of a like at each play, given all that was answered before.

    The exact filter in plain NumPy, apart from the one in `policies`. A score by these
    chances has the same mean as one by the answers, and less variance.

    Args:
        models: of the N items, as they truly are.
        items: (K, T) what was played to K listeners in T slots.
        liked: (K, T).
    """
    chances = np.empty(items.shape)
    rows = np.arange(len(items))
    belief = np.repeat(models.prior[None], len(items), axis=0)  # (K, N, S)
    for slot in range(items.shape[1]):
        item, like = items[:, slot], models.like[items[:, slot]]
        before = belief[rows, item]
        chances[:, slot] = (before * like).sum(axis=1)
        weights = before * np.where(liked[:, slot, None], like, 1 - like)
        after = (weights[:, None, :] @ models.play[item])[:, 0]
        belief = (belief[:, :, None, :] @ models.rest)[:, :, 0]
        belief[rows, item] = after / weights.sum(axis=1, keepdims=True)
    return chances


def check(models: ModelSet, slots: int, listeners: int = 400) -> None:
    """Check that an item played for ever is liked as its closed form says."""
    rng = np.random.default_rng(0)
    belief, exact = models.prior[0], 0.0
    for _ in range(slots):
        exact += float(belief @ models.like[0]) / slots
        belief = belief @ models.play[0]
    rates = np.empty(listeners)
    for number in range(listeners):
        listener = Listener(Luck.drawn(models, slots, rng))
        rates[number] = np.mean([listener.answer(0) for _ in range(slots)])
    assert abs(rates.mean() - exact) < 5 * rates.std() / listeners**0.5
