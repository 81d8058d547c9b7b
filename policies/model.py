"""How a user's interest in one item moves and is answered: a hidden Markov chain.

Meshram and Kaza (2021), "Monte Carlo Rollout Policy for Recommendation Systems with
Dynamic User Behavior", arXiv:2102.04321, section II.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from policies.arrays import Floats

TOLERANCE = 1e-6


class InvalidModel(ValueError):
    """A model that is no pair of Markov chains; `field` names the part at fault."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}")
        self.field = field


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Model:
    """One item type of S hidden states of interest.

    Attributes:
        states: S distinct names.
        play: (S, S) row-stochastic, moves in a slot in which the item is played, P1.
        rest: (S, S) row-stochastic, moves in a slot in which another one is, P0.
        like: (S,) in [0, 1], chance that a play is liked, by state, rho.
        prior: (S,) belief of an item never played, at slot 0, pi0.

    The arrays are own copies. Rows may miss a sum of one by 1e-6 and are normalised.
    """

    states: tuple[str, ...]
    play: Floats
    rest: Floats
    like: Floats
    prior: Floats

    def __init__(
        self,
        states: Sequence[str],
        play: ArrayLike,
        rest: ArrayLike,
        like: ArrayLike,
        prior: ArrayLike,
    ) -> None:
        """Check and copy.

        Raises:
            InvalidModel: names the field, e.g. "play[2]", "like[1]" or "prior".
        """
        size = len(_names(states))
        object.__setattr__(self, "states", tuple(states))
        object.__setattr__(self, "play", _matrix("play", play, size))
        object.__setattr__(self, "rest", _matrix("rest", rest, size))
        object.__setattr__(self, "like", _chances(like, size))
        object.__setattr__(self, "prior", _distribution("prior", prior, size))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what is allowed but looks like a mistake."""
        return tuple(
            f"The chance of a like falls from state {self.states[i]!r}"
            f" ({self.like[i]:g}) to state {self.states[i + 1]!r}"
            f" ({self.like[i + 1]:g})."
            for i in np.flatnonzero(np.diff(self.like) < 0)
        )


def _names(states: Sequence[str]) -> Sequence[str]:
    if isinstance(states, str) or len(states) < 2:  # noqa: PLR2004 - a chain
        raise InvalidModel("states", "needs at least two names")
    for i, name in enumerate(states):
        if not str(name).strip():
            raise InvalidModel(f"states[{i}]", "needs a name")
        if name in states[:i]:
            raise InvalidModel(f"states[{i}]", f"the name {name!r} is taken")
    return states


def _matrix(field: str, values: ArrayLike, size: int) -> Floats:
    matrix = _numbers(field, values, (size, size))
    rows = [_distribution(f"{field}[{i}]", row, size) for i, row in enumerate(matrix)]
    return np.stack(rows)


def _distribution(field: str, values: ArrayLike, size: int) -> Floats:
    chances = _numbers(field, values, (size,))
    if (chances < 0).any():
        raise InvalidModel(field, "has a negative chance")
    total = float(chances.sum())
    if abs(total - 1) > TOLERANCE:
        raise InvalidModel(field, f"sums to {total:.9g}, not to 1")
    return chances / total


def _chances(values: ArrayLike, size: int) -> Floats:
    chances = _numbers("like", values, (size,))
    for i, chance in enumerate(chances):
        if not 0 <= chance <= 1:
            raise InvalidModel(f"like[{i}]", f"is {chance:g}, not a chance from 0 to 1")
    return chances


def _numbers(field: str, values: ArrayLike, shape: tuple[int, ...]) -> Floats:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidModel(field, "is not an array of numbers") from error
    if array.shape != shape:
        raise InvalidModel(field, f"has shape {array.shape}, not {shape}")
    if not np.isfinite(array).all():
        raise InvalidModel(field, "holds a number that is not finite")
    return array
