"""Models stacked into arrays for compiled code."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.compiled import compiled
from policies.model import Model

LEVELS = 41  # rests of up to 2^41 - 1 slots


class ModelSet(NamedTuple):
    """M models of at most S states; a tuple, so that compiled code takes it whole.

    A model of fewer states is padded with states in which nobody ever is: no prior
    belief, no like, and no way in or out; one of fewer signals with signals that are
    never given. That changes no result.

    Attributes:
        play: (M, S, S) row-stochastic, P1.
        rest: (M, S, S) row-stochastic, P0.
        like: (M, S), expected reward, rho.
        prior: (M, S), pi0.
        observe: (M, K, S), chance of each signal by state.
        reward: (M, K), worth of each signal.
        rest_powers: (M, 41, S, S), entry j is `rest` to the power 2^j.
        states: (M,) number of states of each model before padding.
        signals: (M,) number of signals of each model before padding.
    """

    play: Floats
    rest: Floats
    like: Floats
    prior: Floats
    observe: Floats
    reward: Floats
    rest_powers: Floats
    states: Ints
    signals: Ints

    @classmethod
    def of(cls, models: Sequence[Model]) -> "ModelSet":
        """Stack `models`; row m of every array belongs to the m-th one."""
        states = np.array([len(model.states) for model in models], dtype=np.int64)
        signals = np.array([len(model.signals) for model in models], dtype=np.int64)
        size, most = int(states.max(initial=0)), int(signals.max(initial=0))
        rest = _padded_matrices([model.rest for model in models], size)
        return cls(
            play=_padded_matrices([model.play for model in models], size),
            rest=rest,
            like=_padded_vectors([model.like for model in models], size),
            prior=_padded_vectors([model.prior for model in models], size),
            observe=_padded_chances([model.observe for model in models], most, size),
            reward=_padded_vectors([model.reward for model in models], most),
            rest_powers=_powers(rest),
            states=states,
            signals=signals,
        )


def _padded_matrices(matrices: Sequence[Floats], size: int) -> Floats:
    stacked = np.tile(np.eye(size), (len(matrices), 1, 1))
    for row, matrix in zip(stacked, matrices, strict=True):
        row[: len(matrix), : len(matrix)] = matrix
    return stacked


def _padded_vectors(vectors: Sequence[Floats], size: int) -> Floats:
    stacked = np.zeros((len(vectors), size))
    for row, vector in zip(stacked, vectors, strict=True):
        row[: len(vector)] = vector
    return stacked


def _padded_chances(chances: Sequence[Floats], signals: int, size: int) -> Floats:
    stacked = np.zeros((len(chances), signals, size))
    stacked[:, :1] = 1.0  # also where nobody ever is, some signal is given
    for row, chance in zip(stacked, chances, strict=True):
        row[: chance.shape[1], : len(chance)] = chance.T
    return stacked


def _powers(rest: Floats) -> Floats:
    """Square again and again: (M, S, S) to (M, 41, S, S)."""
    powers = [rest]
    while len(powers) < LEVELS:
        powers.append(_squared(powers[-1]))
    return np.ascontiguousarray(np.stack(powers, axis=1))


@compiled
def _squared(matrices: Floats) -> Floats:
    """Square (M, S, S) matrices in a fixed order of sums; rows are kept at sum one."""
    squares = np.zeros_like(matrices)
    for m, i in np.ndindex(matrices.shape[:2]):
        for j in range(matrices.shape[2]):
            squares[m, i] += matrices[m, i, j] * matrices[m, j]
        total = 0.0
        for chance in squares[m, i]:
            total += chance
        squares[m, i] /= total
    return squares
