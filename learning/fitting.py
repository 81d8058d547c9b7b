"""Models of a log: what is asked for, and what is found."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from learning.chain import Chain
from learning.em import Effort, Learned, Spread, Terms, beginnings, learn
from learning.maximization import Smoothing
from learning.mixture import Types, learn_types
from learning.plays import NONE, Bools, Plays
from learning.posterior import Posterior, Sampling, sample
from learning.prediction import predicted
from learning.streams import Streams, streams
from policies import Floats, Ints
from policies.mood import Mood

LEAST_RATE = 0.01  # of likes where chains begin


@dataclass(frozen=True, slots=True)
class Recipe:
    """How models are learned.

    Attributes:
        states: S.
        types: K, models among which items are shared out.
        mood: how answers make a mood; None: without.
        in_time: whether interest rests by the clock, not by slots.
        smoothing: what is imagined beside what was seen.
        effort: how hard to look.
    """

    states: int = 4
    types: int = 1
    mood: Mood | None = None
    in_time: bool = False
    smoothing: Smoothing = field(default_factory=Smoothing)
    effort: Effort = field(default_factory=Effort)


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """What was learned of a log.

    Attributes:
        recipe: how.
        types: chains, and which arm follows which.
        whole: the chain of all arms together.
        shares: (M,) how often each mood was met.
    """

    recipe: Recipe
    types: Types
    whole: Learned
    shares: Floats


def fit(
    plays: Plays, recipe: Recipe, spread: Spread = map, whole: Learned | None = None
) -> Fitted:
    """Learn models.

    Args:
        plays: the log.
        recipe: how.
        spread: how the work is spread.
        whole: the chain of all arms together, if it was learned before.

    Raises:
        ValueError: no play was answered, or rests in time are asked for where the log
            knows no times.
    """
    if (plays.answer == NONE).all():
        raise ValueError("no play of the log was answered")
    mood = moods_of(plays, recipe.mood)
    seen = streams(plays, mood, in_time=recipe.in_time)
    moods = recipe.mood.classes if recipe.mood else 1
    whole = whole or _whole(plays, seen, moods, recipe, spread)
    types = _types(seen, whole.chain, len(plays.arms), recipe, spread)
    met = np.bincount(mood, minlength=moods) + 1e-3
    return Fitted(recipe, types, whole, met / met.sum())


def _whole(
    plays: Plays, seen: Streams, moods: int, recipe: Recipe, spread: Spread
) -> Learned:
    reward = np.array(plays.reward)
    rate = float(reward[plays.answer[plays.answer != NONE]].mean())
    begun = beginnings(
        recipe.states,
        min(max(rate, LEAST_RATE), 1 - LEAST_RATE),
        recipe.effort,
        moods=moods,
        signals=len(plays.signals),
        in_time=recipe.in_time,
    )
    return learn(seen, begun, reward, recipe.effort, Terms(recipe.smoothing), spread)


def moods_of(plays: Plays, mood: Mood | None) -> Ints:
    """Return (P,): the class of the user's mood at each play."""
    if mood is None:
        return np.zeros(len(plays), dtype=np.int64)
    liked = plays.liked.astype(np.int64)
    return mood.along(plays.first, liked, plays.seconds, plays.slots)


def _types(
    seen: Streams, whole: Chain, arms: int, recipe: Recipe, spread: Spread
) -> Types:
    if recipe.types > 1:
        return learn_types(
            seen, whole, arms, recipe.types, recipe.effort, recipe.smoothing, spread
        )
    return Types([whole], np.ones(1), np.ones((arms, 1)))


def expected(plays: Plays, fitted: Fitted) -> Floats:
    """Return (P, K): the chance of each signal before each play of a log.

    An arm follows its likeliest type, as an item does in the service.
    """
    recipe, types = fitted.recipe, fitted.types
    mood = moods_of(plays, recipe.mood)
    return predicted(plays, types.chains, types.of_arms, mood, in_time=recipe.in_time)


def draw(
    plays: Plays,
    fitted: Fitted,
    sampling: Sampling,
    spread: Spread = map,
    tell: Callable[[], object] = lambda: None,
) -> Sequence[Posterior]:
    """Return, for each type, what its chain may be as well as not.

    Each is drawn from the plays of the arms that follow it.

    Args:
        plays: the log that it was learned from.
        fitted: what was learned.
        sampling: how.
        spread: how the work is spread.
        tell: called after each draw, for each type.
    """
    recipe, types = fitted.recipe, fitted.types
    seen = streams(plays, moods_of(plays, recipe.mood), in_time=recipe.in_time)
    reward, kind = np.array(plays.reward), types.of_arms[seen.arm]
    return [
        sample(
            seen.of(kind == k), chain, reward, recipe.smoothing, sampling, spread, tell
        )
        for k, chain in enumerate(types.chains)
    ]


@dataclass(frozen=True, slots=True)
class ChainForecaster:
    """Foretells likes by models that are learned from the plays to train on."""

    recipe: Recipe
    spread: Spread = map

    def __call__(self, plays: Plays, train: Bools) -> Floats:
        """Return (P,): the expected reward of each play, from those before it."""
        fitted = fit(plays.of(train), self.recipe, self.spread)
        found: Floats = expected(plays, fitted) @ np.array(plays.reward)
        return found
