"""Models stacked into arrays for compiled code."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints, as_ints
from policies.compiled import compiled
from policies.model import InvalidModel, Model
from policies.mood import (
    LIKED,
    NO_RULE,
    NONE,
    Bools,
    Mood,
    MoodState,
    Rule,
    class_of,
    course,
    next_state,
    paused,
)

LEVELS = 41  # rests of up to 2^41 - 1 slots


class ModelSet(NamedTuple):
    """M models of at most S states; a tuple, so that compiled code takes it whole.

    A model of fewer states is padded with states in which nobody ever is: no prior
    belief, no like, and no way in or out; one of fewer signals with signals that are
    never given. That changes no result.

    A model with samples is one chain over pairs of a sample and a state: the states of
    its first sample, then those of the second, and so on, with no way from one sample
    to another and a prior that is even over samples. So a belief in it is exactly what
    the answers tell of both, and a policy plans with what it may yet learn.

    Where models have a mood, it is one and the same; models without it answer alike in
    all moods.

    Attributes:
        play: (M, S, S) row-stochastic, P1.
        rest: (M, S, S) row-stochastic, P0.
        like: (M, S), expected reward, rho.
        prior: (M, S), pi0.
        observe: (M, K, S), chance of each signal by state.
        reward: (M, K), worth of each signal.
        rest_powers: (M, 41, S, S), entry j is `rest` to the power 2^j.
        states: (M,) number of states of each model before padding, in all its samples.
        signals: (M,) number of signals of each model before padding.
        samples: (M,) number of samples of each model; 1 if it has none.
        classes: C, number of moods; 1 if no model has a mood.
        rule: by which answers make a mood, see `mood`.
        like_in: (M C, S) `like` by mood, model m in mood c in row m C + c; where C is
            1, this is `like`.
        observe_in: (M C, K, S) `observe` by mood, in the same rows.
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
    samples: Ints
    classes: int
    rule: Rule
    like_in: Floats
    observe_in: Floats

    @classmethod
    def of(cls, models: Sequence[Model]) -> "ModelSet":
        """Stack `models`; row m of every array belongs to the m-th one.

        Raises:
            InvalidModel: "mood": two of them have different ones.
        """
        mood = mood_of(models)
        classes, rule = (1, NO_RULE) if mood is None else (mood.classes, mood.rule)
        return _stacked([_chain(model) for model in models], classes, rule)

    @property
    def most_like(self) -> Floats:
        """(M, S): the greatest expected reward in any mood."""
        shape = (len(self.like), self.classes, self.like.shape[1])
        most: Floats = self.like_in.reshape(shape).max(axis=1)
        return most

    def mood_class(self, state: MoodState, resumed: bool) -> int:
        """Return the class of a mood, 0 to C - 1.

        Args:
            state: what it follows from.
            resumed: whether a play comes after a pause.
        """
        return 0 if self.classes == 1 else class_of(self.rule, state, resumed)

    def resumed(self, waited_s: float | None) -> bool:
        """Return whether a play comes after a pause that makes a mood of its own.

        Args:
            waited_s: seconds since the last play; None: it is the first, or nobody
                knows.
        """
        return paused(self.rule, waited_s)

    def liked(self, m: int, signal: int) -> int:
        """Return 1 if a signal of model m is a like, 0 if another, NONE if none."""
        return NONE if signal == NONE else int(self.reward[m, signal] >= LIKED)

    def mood_after(self, state: MoodState, liked: int) -> MoodState:
        """Return what a mood follows from after an answer, see `liked`."""
        if self.classes == 1:
            return state
        return MoodState(*next_state(self.rule, state, liked))

    def mood_course(
        self, liked: Ints, slots: Ints, resumed: Bools
    ) -> tuple[Ints, MoodState]:
        """Return the class of the mood in each play of a user's log.

        Args:
            liked: (P,) see `liked`.
            slots: (P,) ascending; the plays of one are all in the mood it begins in.
            resumed: (P,) whether a slot that begins there comes after a pause.

        Returns:
            (P,) classes, and what the mood of the last slot follows from.
        """
        found, state = course(self.rule, as_ints(liked), as_ints(slots), resumed)
        return found, MoodState(*state)

    def separated(self) -> "ModelSet":
        """Return all samples as models of their own: of row 0, of row 1, and so on.

        Models without samples are their own. If there are no others, nothing changes.
        """
        if (self.samples == 1).all():
            return self
        rows = range(len(self.samples))
        samples = [_sample(self, m, k) for m in rows for k in range(self.samples[m])]
        return _stacked(samples, self.classes, self.rule)

    def by_state(self, m: int, belief: Floats) -> Floats:
        """Return the belief about the state alone, whichever sample is the true one.

        Args:
            m: row of the model.
            belief: (S,) over pairs of a sample and a state, padded.

        Returns:
            As many chances as a sample has states.
        """
        pairs = belief[: self.states[m]].reshape(self.samples[m], -1)
        folded: Floats = pairs.sum(axis=0)
        return folded

    def drawn(self, k: int) -> "ModelSet":
        """Return sample k of each model, or k modulo their number."""
        rows = range(len(self.samples))
        samples = [_sample(self, m, k % self.samples[m]) for m in rows]
        return _stacked(samples, self.classes, self.rule)


def mood_of(models: Sequence[Model]) -> Mood | None:
    """Return the mood that models have, if any has one.

    Raises:
        InvalidModel: "mood": two of them have different ones.
    """
    found = {m: model.mood for m, model in enumerate(models) if model.mood is not None}
    first = next(iter(found), 0)
    for m, mood in found.items():
        if mood != found[first]:
            raise InvalidModel("mood", f"model {m} has another one than model {first}")
    return found.get(first)


class _Chain(NamedTuple):
    """One row before padding; see `ModelSet`.

    `observe` is (S, K), `like_in` (C, S), and `observe_in` (C, S, K); C is 1 here if
    the model has no mood.
    """

    play: Floats
    rest: Floats
    like: Floats
    prior: Floats
    observe: Floats
    reward: Floats
    like_in: Floats
    observe_in: Floats
    samples: int = 1


def _chain(model: Model) -> _Chain:
    samples = model.samples or (model,)
    return _Chain(
        play=_block_diagonal([sample.play for sample in samples]),
        rest=_block_diagonal([sample.rest for sample in samples]),
        like=np.concatenate([sample.like for sample in samples]),
        prior=np.concatenate([sample.prior / len(samples) for sample in samples]),
        observe=np.concatenate([sample.observe for sample in samples]),
        reward=model.reward,
        like_in=np.concatenate([sample.like_in for sample in samples], axis=1),
        observe_in=np.concatenate([sample.observe_in for sample in samples], axis=1),
        samples=len(samples),
    )


def _sample(models: ModelSet, m: int, k: int) -> _Chain:
    """Cut sample k out of model m."""
    size, signals = models.states[m] // models.samples[m], models.signals[m]
    own = slice(k * size, (k + 1) * size)
    moods = slice(m * models.classes, (m + 1) * models.classes)
    return _Chain(
        play=models.play[m, own, own],
        rest=models.rest[m, own, own],
        like=models.like[m, own],
        prior=models.prior[m, own] * models.samples[m],
        observe=models.observe[m, :signals, own].T,
        reward=models.reward[m, :signals],
        like_in=models.like_in[moods, own],
        observe_in=models.observe_in[moods, :signals, own].swapaxes(1, 2),
    )


def _stacked(chains: Sequence[_Chain], classes: int, rule: Rule) -> ModelSet:
    states = np.array([len(chain.like) for chain in chains], dtype=np.int64)
    signals = np.array([len(chain.reward) for chain in chains], dtype=np.int64)
    size, most = int(states.max(initial=0)), int(signals.max(initial=0))
    rest = _padded_matrices([chain.rest for chain in chains], size)
    like = like_in = _padded_vectors([chain.like for chain in chains], size)
    observe = observe_in = _padded_chances(
        [chain.observe for chain in chains], most, size
    )
    if classes > 1:
        like_in = _padded_vectors(
            [each for chain in chains for each in _in_all(chain.like_in, classes)], size
        )
        observe_in = _padded_chances(
            [each for chain in chains for each in _in_all(chain.observe_in, classes)],
            most,
            size,
        )
    return ModelSet(
        play=_padded_matrices([chain.play for chain in chains], size),
        rest=rest,
        like=like,
        prior=_padded_vectors([chain.prior for chain in chains], size),
        observe=observe,
        reward=_padded_vectors([chain.reward for chain in chains], most),
        rest_powers=_powers(rest),
        states=states,
        signals=signals,
        samples=np.array([chain.samples for chain in chains], dtype=np.int64),
        classes=classes,
        rule=rule,
        like_in=like_in,
        observe_in=observe_in,
    )


def _in_all(chances: Floats, classes: int) -> Floats:
    """Return (C, ...): chances by mood, or the same in all moods."""
    return np.broadcast_to(chances, (classes, *chances.shape[1:]))


def _block_diagonal(matrices: Sequence[Floats]) -> Floats:
    """Put matrices of one size along the diagonal."""
    size = len(matrices[0])
    blocks = np.zeros((len(matrices) * size, len(matrices) * size))
    for k, matrix in enumerate(matrices):
        own = slice(k * size, (k + 1) * size)
        blocks[own, own] = matrix
    return blocks


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
