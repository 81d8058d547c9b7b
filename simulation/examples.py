"""The examples of the paper.

Meshram and Kaza (2021), arXiv:2102.04321, "Numerical Results". The matrices of examples
1 to 3 are as printed, but for the entry "0..3", which is 0.3. Of example 4 the paper
prints no numbers: instances of it are drawn.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from policies import Floats, Model, Situation
from simulation.listeners import Listeners
from simulation.opening import opening

DATA = files("simulation") / "data"
DISCOUNT = 0.95  # of all examples
IN_STATES = (1, 0, 2, 1, 0)  # X = [2, 1, 3, 2, 1], counted from 0; of all examples
NUMBERS = (1, 2, 3)
STATES = ("low", "medium", "high", "very high")
ITEMS = 15  # of example 4
STEEPEST = 3.0  # of the exponents of ordered models


@dataclass(frozen=True, slots=True)
class Example:
    """One item of each model. `ids`: of the items."""

    ids: Sequence[str]
    models: Sequence[Model]

    @property
    def start(self) -> Situation:
        """Return the items as a new listener meets them."""
        return opening(self.models)

    def in_states(self, start: Situation, *, clicks: bool = False) -> Listeners:
        """Return the paper's listeners, who begin in certain states."""
        return Listeners.in_states(start, IN_STATES, clicks=clicks)


def example(number: int) -> Example:
    """Return an example, 1 to 3.

    Raises:
        ValueError: there is no such example.
    """
    if number not in NUMBERS:
        raise ValueError(f"example: must be one of {NUMBERS}, not {number}")
    entries = json.loads((DATA / f"example-{number}.json").read_text())
    return Example(
        [entry["id"] for entry in entries],
        [
            Model(
                *(entry[name] for name in ("states", "play", "rest", "like", "prior"))
            )
            for entry in entries
        ],
    )


def drawn(seed: int, items: int = ITEMS) -> Sequence[Model]:
    """Draw an instance of example 4: models whose rows are even over all distributions.

    Interest has an order, as the paper wants it: like chances rise with the state.
    """
    rng = np.random.default_rng(seed)
    rows = np.ones(len(STATES))
    return [
        Model(
            STATES,
            rng.dirichlet(rows, len(STATES)),
            rng.dirichlet(rows, len(STATES)),
            np.sort(rng.random(len(STATES))),
            rng.dirichlet(rows),
        )
        for _ in range(items)
    ]


def ordered(seed: int, items: int) -> Sequence[Model]:
    """Draw models with the structure that the paper names: all of it, in all items.

    Matrices are totally positive of order 2, w_j exp(x_i y_j) with rising x and y, so
    that their rows rise stochastically; the prior is such a row; like chances rise.
    """
    rng = np.random.default_rng([seed, 2])
    states = len(STATES)

    def rows(count: int) -> Floats:
        steep = STEEPEST * np.sort(rng.random(count))[:, None]
        weights = rng.dirichlet(np.ones(states)) * np.exp(
            steep * np.sort(rng.random(states))
        )
        found: Floats = weights / weights.sum(axis=1, keepdims=True)
        return found

    return [
        Model(
            STATES, rows(states), rows(states), np.sort(rng.random(states)), rows(1)[0]
        )
        for _ in range(items)
    ]
