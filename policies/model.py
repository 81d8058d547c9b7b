"""How a user's interest in one item moves and is answered: a hidden Markov chain.

Meshram and Kaza (2021), "Monte Carlo Rollout Policy for Recommendation Systems with
Dynamic User Behavior", arXiv:2102.04321, section II.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from policies.arrays import Floats
from policies.mood import Mood

TOLERANCE = 1e-6
NO_ANSWER = "none"


class InvalidModel(ValueError):
    """A model that is no pair of Markov chains; `field` names the part at fault."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}")
        self.field = field


class Signals(NamedTuple):
    """What a play may tell: K names, (S, K) chances by state, (K,) rewards.

    Of a model with moods, the chances are (C, S, K).
    """

    names: Sequence[str]
    observe: ArrayLike
    reward: ArrayLike


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Model:
    """One item type of S hidden states of interest, whose plays give K signals.

    Attributes:
        states: S distinct names.
        play: (S, S) row-stochastic, moves in a slot in which the item is played, P1.
        rest: (S, S) row-stochastic, moves in a slot in which another one is, P0.
        like: (S,) in [0, 1], expected reward of a play, by state, rho: where the
            signals are a skip and a like, the chance that it is liked.
        prior: (S,) belief of an item never played, at slot 0, pi0.
        signals: K names, none of them "none"; ("skip", "like") unless others are given.
        observe: (S, K) row-stochastic, chance of each signal, by state.
        reward: (K,) in [0, 1], worth of each signal.
        samples: what the model may be as well as not: draws from a posterior, of the
            same states and signals. If there are any, they are what counts, all alike
            at first: the model then acts as one chain over pairs of a sample and a
            state. The fields above describe their middle, for people.
        mood: how the user's last answers, to any items, make one of C moods, on which
            the chances of signals depend beside the state; None: they do not, C = 1.
        shares: (C,) how often each mood is met, of sum one. `like` and `observe` are
            the means by these shares; what goes by one number a state goes by them.
        like_in: (C, S) `like` in each mood.
        observe_in: (C, S, K) `observe` in each mood.

    Rewards from 0 to 1 are no restriction: one item is played in every slot, so a
    reward c R + d scales every value by c, shifts it by a constant, and changes no
    choice. The arrays are own copies. Rows may miss a sum of one by 1e-6 and are
    normalised.
    """

    states: tuple[str, ...]
    play: Floats
    rest: Floats
    like: Floats
    prior: Floats
    signals: tuple[str, ...]
    observe: Floats
    reward: Floats
    samples: tuple["Model", ...]
    mood: Mood | None
    shares: Floats
    like_in: Floats
    observe_in: Floats

    def __init__(
        self,
        states: Sequence[str],
        play: ArrayLike,
        rest: ArrayLike,
        like: ArrayLike | None,
        prior: ArrayLike,
        signals: Signals | None = None,
        *,
        samples: Sequence["Model"] = (),
        mood: Mood | None = None,
        shares: ArrayLike | None = None,
    ) -> None:
        """Check and copy.

        Args:
            states: see the class.
            play: see the class.
            rest: see the class.
            like: see the class; (C, S) if there are moods. None if there are
                `signals`, which imply it.
            prior: see the class.
            signals: what a play may tell, None: a skip or a like.
            samples: see the class.
            mood: see the class.
            shares: see the class; None: even.

        Raises:
            InvalidModel: names the field, e.g. "play[2]", "like[1]" or "prior"; of a
                model with moods, "like[3][1]" or "observe[3][1]".
        """
        size = len(_names("states", states, least=2))
        if (like is None) == (signals is None):
            raise InvalidModel("like", "give either the chance of a like or signals")
        object.__setattr__(self, "states", tuple(states))
        object.__setattr__(self, "play", _matrix("play", play, (size, size)))
        object.__setattr__(self, "rest", _matrix("rest", rest, (size, size)))
        object.__setattr__(self, "prior", _distribution("prior", prior, size))
        names, observe_in, reward = _observed(like, signals, size, mood)
        like_in = np.stack([observe @ reward for observe in observe_in])
        even = np.full(len(observe_in), 1 / len(observe_in))
        shared = even if shares is None else _shared(shares, mood)
        object.__setattr__(self, "signals", names)
        object.__setattr__(self, "observe_in", observe_in)
        object.__setattr__(self, "observe", _mean(observe_in, shared))
        object.__setattr__(self, "reward", reward)
        object.__setattr__(self, "like_in", np.minimum(like_in, 1.0))
        object.__setattr__(self, "like", _mean(self.like_in, shared))
        object.__setattr__(self, "mood", mood)
        object.__setattr__(self, "shares", shared)
        object.__setattr__(self, "samples", tuple(samples))
        self._check_samples()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what is allowed but looks like a mistake."""
        return tuple(
            f"The expected reward of a play falls from state {self.states[i]!r}"
            f" ({self.like[i]:g}) to state {self.states[i + 1]!r}"
            f" ({self.like[i + 1]:g})."
            for i in np.flatnonzero(np.diff(self.like) < 0)
        )

    def _check_samples(self) -> None:
        for i, sample in enumerate(self.samples):
            if (sample.states, sample.signals) != (self.states, self.signals):
                raise InvalidModel(f"samples[{i}]", "has other states or signals")
            if not np.array_equal(sample.reward, self.reward):
                raise InvalidModel(f"samples[{i}]", "has other rewards")
            if sample.mood != self.mood:
                raise InvalidModel(f"samples[{i}]", "has another mood")
            if sample.samples:
                raise InvalidModel(f"samples[{i}]", "has samples itself")


def _names(field: str, names: Sequence[str], least: int) -> Sequence[str]:
    if isinstance(names, str) or len(names) < least:
        raise InvalidModel(field, f"needs at least {least} of them")
    for i, name in enumerate(names):
        if not str(name).strip():
            raise InvalidModel(f"{field}[{i}]", "needs a name")
        if name in names[:i]:
            raise InvalidModel(f"{field}[{i}]", f"the name {name!r} is taken")
    return names


def _observed(
    like: ArrayLike | None, signals: Signals | None, size: int, mood: Mood | None
) -> tuple[tuple[str, ...], Floats, Floats]:
    """Return names, chances (C, S, K) and rewards of the signals."""
    if signals is None:
        chance = _in_moods(_chances, "like", like, (size,), mood)
        observe = np.stack((1 - chance, chance), axis=2)
        return ("skip", "like"), observe, np.array((0.0, 1.0))
    names = tuple(_names("signals", signals.names, least=1))
    if NO_ANSWER in names:
        at = names.index(NO_ANSWER)
        raise InvalidModel(f"signals[{at}]", f"{NO_ANSWER!r} says there was no answer")
    shape = (size, len(names))
    observe = _in_moods(_matrix, "observe", signals.observe, shape, mood)
    return names, observe, _chances("reward", signals.reward, (len(names),))


def _in_moods(
    check: Callable[[str, ArrayLike | None, tuple[int, ...]], Floats],
    field: str,
    values: ArrayLike | None,
    shape: tuple[int, ...],
    mood: Mood | None,
) -> Floats:
    """Return (C, ...): what is given once, or for each mood."""
    if mood is None:
        return check(field, values, shape)[None]
    given = _numbers(field, values, (mood.classes, *shape))
    return np.stack(
        [check(f"{field}[{c}]", each, shape) for c, each in enumerate(given)]
    )


def _shared(shares: ArrayLike, mood: Mood | None) -> Floats:
    if mood is None:
        raise InvalidModel("shares", "are of moods, and there is no mood")
    return _distribution("shares", shares, mood.classes)


def _mean(values: Floats, shares: Floats) -> Floats:
    """Return the mean of (C, ...) chances by shares; of equal ones, exactly those."""
    first = values[0]
    mean: Floats = np.clip(first + np.tensordot(shares, values - first, 1), 0.0, 1.0)
    return mean


def _matrix(field: str, values: ArrayLike | None, shape: tuple[int, ...]) -> Floats:
    matrix = _numbers(field, values, shape)
    return np.stack(
        [_distribution(f"{field}[{i}]", row, shape[1]) for i, row in enumerate(matrix)]
    )


def _distribution(field: str, values: ArrayLike, size: int) -> Floats:
    chances = _numbers(field, values, (size,))
    if (chances < 0).any():
        raise InvalidModel(field, "has a negative chance")
    total = float(chances.sum())
    if abs(total - 1) > TOLERANCE:
        raise InvalidModel(field, f"sums to {total:.9g}, not to 1")
    return chances / total


def _chances(field: str, values: ArrayLike | None, shape: tuple[int, ...]) -> Floats:
    chances = _numbers(field, values, shape)
    for i, chance in enumerate(chances):
        if not 0 <= chance <= 1:
            raise InvalidModel(f"{field}[{i}]", f"is {chance:g}, not from 0 to 1")
    return chances


def _numbers(field: str, values: ArrayLike | None, shape: tuple[int, ...]) -> Floats:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidModel(field, "is not an array of numbers") from error
    if array.shape != shape:
        raise InvalidModel(field, f"has shape {array.shape}, not {shape}")
    if not np.isfinite(array).all():
        raise InvalidModel(field, "holds a number that is not finite")
    return array
