"""Two plain versions of rollout, to be compared with; they share no code with Encore.

One is the paper's rollout in NumPy, vectorised over trajectories. The other is the
exact tree in Numba, for every item on its own: no schedule, no groups.
"""

import numba
import numpy as np

from policies import Floats, Situation

Models = tuple[Floats, Floats, Floats]


def models_of(situation: Situation) -> Models:
    """Return play (N, S, S), rest (N, S, S) and like (N, S) of each item."""
    models, rows = situation.models, situation.model
    return models.play[rows], models.rest[rows], models.like[rows]


def myopic(situation: Situation) -> int:
    likes = situation.models.like[situation.model]
    return int((situation.belief * likes).sum(axis=1).argmax())


def sampled(  # noqa: PLR0913, PLR0917 - the parameters of the paper
    models: Models,
    belief: Floats,
    rng: np.random.Generator,
    base: str,
    horizon: int,
    trajectories: int,
    discount: float,
) -> Floats:
    """Score items one after the other, all trajectories at once: (N, L, S) beliefs."""
    play, rest, likes = models
    items, lines = len(belief), np.arange(trajectories)
    scores = np.empty(items)
    for first in range(items):
        imagined = np.repeat(belief[:, None, :], trajectories, axis=1)
        total = np.zeros(trajectories)
        played = np.full(trajectories, first)
        for h in range(horizon + 1):
            chances = (imagined * likes[:, None, :]).sum(axis=2)  # (N, L)
            if h > 0 and base == "myopic":
                played = chances.argmax(axis=0)
            elif h > 0:
                played = rng.integers(items, size=trajectories)
            chance = chances[played, lines]
            total += discount**h * chance
            liked = rng.random(trajectories) < chance
            like = likes[played]
            weights = imagined[played, lines] * np.where(liked[:, None], like, 1 - like)
            after = (weights[:, None, :] @ play[played])[:, 0]
            imagined = imagined @ rest
            imagined[played, lines] = after / weights.sum(axis=1, keepdims=True)
        scores[first] = total.mean()
    return scores


def exact(models: Models, belief: Floats, horizon: int, discount: float) -> Floats:
    """Score every item by all futures of the myopic base."""
    room = np.empty((horizon + 1, *belief.shape))
    room[0] = belief
    return np.array(
        [_value(*models, room, 0, item, discount) for item in range(len(belief))]
    )


@numba.njit(nogil=True, error_model="numpy")
def _value(  # noqa: C901, PLR0913, PLR0917 - plain, and compiled
    play: Floats,
    rest: Floats,
    like: Floats,
    belief: Floats,
    h: int,
    item: int,
    discount: float,
) -> float:
    """Return what playing an item at level h earns, and what follows."""
    items, states = belief.shape[1:]
    chance = 0.0
    for i in range(states):
        chance += belief[h, item, i] * like[item, i]
    if h + 1 == len(belief):
        return chance
    for n in range(items):
        for j in range(states):
            belief[h + 1, n, j] = 0.0
            for i in range(states):
                belief[h + 1, n, j] += belief[h, n, i] * rest[n, i, j]
    future = 0.0
    for liked in range(2):
        weight = chance if liked else 1.0 - chance
        if weight <= 0.0:
            continue
        for j in range(states):
            belief[h + 1, item, j] = 0.0
            for i in range(states):
                told = like[item, i] if liked else 1.0 - like[item, i]
                moved = belief[h, item, i] * told * play[item, i, j]
                belief[h + 1, item, j] += moved / weight
        best, most = 0, -1.0
        for n in range(items):
            value = 0.0
            for i in range(states):
                value += belief[h + 1, n, i] * like[n, i]
            if value > most:
                best, most = n, value
        future += weight * _value(play, rest, like, belief, h + 1, best, discount)
    return chance + discount * future
