"""Listeners with true states, drawn from the models but never told to the service."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.api.schemas.items import ItemView
from app.api.schemas.models import ModelView

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Nature:
    """How interest in N items truly moves; S is the largest number of states.

    row:   for each item its place in `items`
    model: (N,) row of each item's model
    play:  (M, S, S) chances added up along the last axis, as are the next two
    rest:  (M, S, S)
    prior: (M, S)
    like:  (M, S) chance of a like
    """

    row: dict[str, int]
    model: Ints
    play: Floats
    rest: Floats
    prior: Floats
    like: Floats

    @classmethod
    def of(cls, models: Sequence[ModelView], items: Sequence[ItemView]) -> "Nature":
        states = max(len(model.states) for model in models)
        rows = {model.id: row for row, model in enumerate(models)}
        return cls(
            {item.id: row for row, item in enumerate(items)},
            np.array([rows[item.model] for item in items], np.int64),
            np.stack([_moves(model.play, states) for model in models]),
            np.stack([_moves(model.rest, states) for model in models]),
            np.stack([_added_up(model.prior, states) for model in models]),
            np.stack([_padded(model.like, states) for model in models]),
        )


class Listener:
    """Someone whose interest in every item moves with every play, unseen."""

    def __init__(self, nature: Nature, rng: np.random.Generator) -> None:
        self._nature = nature
        self._rng = rng
        self._state = self._draw(nature.prior[nature.model])

    def hear(self, item: str) -> bool:
        """Play an item; tell whether it was liked. Every interest moves on."""
        nature, state = self._nature, self._state
        row = nature.row[item]
        model = nature.model[row]
        liked = bool(self._rng.random() < nature.like[model, state[row]])
        moves = nature.rest[nature.model, state]
        moves[row] = nature.play[model, state[row]]
        self._state = self._draw(moves)
        return liked

    def _draw(self, added_up: Floats) -> Ints:
        """One state for each row of chances added up."""
        throws = self._rng.random((len(added_up), 1))
        state: Ints = np.argmax(throws < added_up, axis=1)
        return state


def _moves(matrix: Sequence[Sequence[float]], states: int) -> Floats:
    rows = [_added_up(row, states) for row in matrix]
    return np.stack(rows + [np.ones(states)] * (states - len(rows)))


def _added_up(chances: Sequence[float], states: int) -> Floats:
    """Chances added up; the last one takes what rounding leaves."""
    total = np.cumsum(_padded(chances, states))
    total[len(chances) - 1 :] = 1
    return total


def _padded(values: Sequence[float], states: int) -> Floats:
    return np.array([*values, *[0.0] * (states - len(values))])
