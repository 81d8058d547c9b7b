"""Listeners with true states, drawn from the models but never told to the service."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.api.schemas.items import ItemView
from app.api.schemas.model_views import ModelView

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Nature:
    """How interest in N items truly moves, for M models of at most S states.

    row:     for each item its place in `items`
    model:   (N,) row of each item's model
    play:    (M, S, S) chances added up along the last axis, as are the next three
    rest:    (M, S, S)
    prior:   (M, S)
    observe: (M, S, K) chances of the signals, of which there are at most K
    signals: (M) names of each model's signals, in order
    reward:  (M) worth of each of them
    """

    row: dict[str, int]
    model: Ints
    play: Floats
    rest: Floats
    prior: Floats
    observe: Floats
    signals: Sequence[Sequence[str]]
    reward: Sequence[Sequence[float]]

    @classmethod
    def of(cls, models: Sequence[ModelView], items: Sequence[ItemView]) -> "Nature":
        states = max(len(model.states) for model in models)
        signals = max(len(model.signals) for model in models)
        rows = {model.id: row for row, model in enumerate(models)}
        return cls(
            {item.id: row for row, item in enumerate(items)},
            np.array([rows[item.model] for item in items], np.int64),
            np.stack([_rows(model.play, states, states) for model in models]),
            np.stack([_rows(model.rest, states, states) for model in models]),
            np.stack([_added_up(model.prior, states) for model in models]),
            np.stack([_rows(model.observe, states, signals) for model in models]),
            [model.signals for model in models],
            [model.reward for model in models],
        )


class Heard(NamedTuple):
    """How a listener took a play, and what that is worth."""

    signal: str
    reward: float


class Listener:
    """Someone whose interest in every item moves with every play, unseen."""

    def __init__(self, nature: Nature, rng: np.random.Generator) -> None:
        self._nature = nature
        self._rng = rng
        self._state = self._draw(nature.prior[nature.model])

    def hear(self, item: str) -> Heard:
        """Play an item; tell how it was taken. Every interest moves on."""
        nature, state = self._nature, self._state
        row = nature.row[item]
        model = nature.model[row]
        [told] = self._draw(nature.observe[model, state[row]][None])
        moves = nature.rest[nature.model, state]
        moves[row] = nature.play[model, state[row]]
        self._state = self._draw(moves)
        return Heard(nature.signals[model][told], nature.reward[model][told])

    def _draw(self, added_up: Floats) -> Ints:
        """One state, or signal, for each row of chances added up."""
        throws = self._rng.random((len(added_up), 1))
        drawn: Ints = np.argmax(throws < added_up, axis=1)
        return drawn


def _rows(matrix: Sequence[Sequence[float]], count: int, width: int) -> Floats:
    rows = [_added_up(row, width) for row in matrix]
    return np.stack(rows + [np.ones(width)] * (count - len(rows)))


def _added_up(chances: Sequence[float], width: int) -> Floats:
    """Chances added up; the last one takes what rounding leaves."""
    total = np.ones(width)
    total[: len(chances) - 1] = np.cumsum(chances[:-1])
    return total
