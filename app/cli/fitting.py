"""What `encore fit` does with a log."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from app.cli.console import Failed, progress
from app.cli.fit_report import Found
from app.services import fits
from app.services.items import NewItem
from app.services.new_models import MOST_STATES
from learning import Plays
from learning.em import Spread
from learning.fitting import Fitted, Recipe, draw, fit, moods_of
from learning.held_out import Split
from learning.identification import identify
from learning.posterior import Posterior, Sampling
from learning.resampling import intervals
from learning.selection import Selection, select
from learning.streams import streams


@dataclass(frozen=True, slots=True)
class Asked:
    """How models are learned.

    recipe:  but for numbers of states and types
    states:  to choose from
    types:   to choose from
    draws:   of users, for intervals
    samples: of each model, drawn from what the log leaves open
    sweeps:  over the log, for each of them
    mood:    whether likes also depend on the last answers
    stay:    items that nothing is told of stay with the models they have
    """

    recipe: Recipe
    states: Sequence[int]
    types: Sequence[int]
    draws: int
    samples: int
    sweeps: int
    mood: bool
    stay: bool

    def check(self) -> None:
        """Refuse samples that no model may have."""
        if self.samples * max(self.states) > MOST_STATES:
            raise Failed(
                f"--samples {self.samples}: with up to {max(self.states)} states each,"
                f" a model would have more than {MOST_STATES} in all.",
                status=2,
            )


def learned(
    plays: Plays,
    split: Split,
    items: Sequence[NewItem] | None,
    asked: Asked,
    spread: Spread,
) -> Found:
    """Learn, and judge what was learned.

    Raises:
        Failed: nothing can be learned from the log, or not what was asked for.
    """
    began = time.perf_counter()
    learned, plain = plays.of(split.learned), None
    if asked.mood:
        moody = replace(asked.recipe, mood=fits.usual_mood(plays))
        asked = replace(asked, recipe=moody)
    try:
        recipe, selection = _sized(learned, asked, spread)
        fitted = fit(learned, recipe, spread)
        if asked.mood:
            plain = fit(learned, replace(recipe, mood=None), spread)
    except ValueError as error:
        raise Failed(f"{error}.") from error
    mood = moods_of(learned, recipe.mood)
    seen = streams(learned, mood, in_time=recipe.in_time)
    identified = identify(seen, fitted.whole, recipe.smoothing, spread)
    sure = None
    if asked.draws:
        reward, seed = np.array(plays.reward), recipe.effort.seed
        resample = partial(intervals, seen, fitted.whole, reward, recipe.smoothing)
        sure = resample(draws=asked.draws, seed=seed, spread=spread)
    drawn = _drawn(learned, fitted, asked, spread)
    placed = fits.place(fitted, learned, items, stay=asked.stay)
    judged = fits.judged(plays, split.learned, fitted, placed, plain)
    took = time.perf_counter() - began
    return Found(
        plays, split, selection, fitted, drawn, placed, identified, sure, judged, took
    )


def _drawn(
    plays: Plays, fitted: Fitted, asked: Asked, spread: Spread
) -> Sequence[Posterior]:
    """What each model may be as well as not; empty if nobody asked."""
    if not asked.samples:
        return ()
    sampling = Sampling(asked.samples, asked.sweeps, asked.recipe.effort.seed)
    with progress() as bar:
        total = sampling.kept * len(fitted.types.chains)
        task = bar.add_task("samples", total=total)
        return draw(plays, fitted, sampling, spread, partial(bar.advance, task))


def _sized(
    plays: Plays, asked: Asked, spread: Spread
) -> tuple[Recipe, Selection | None]:
    """How to learn, with numbers that were chosen where there is a choice."""
    states, types = asked.states, asked.types
    recipe = replace(asked.recipe, states=states[0], types=types[0])
    if len(states) == len(types) == 1:
        return recipe, None
    with progress() as bar:
        task = bar.add_task("sizes", total=len(states) + len(types) - 1)
        tell = partial(bar.advance, task)
        found = select(plays, recipe, states, types, spread, tell)
    return replace(recipe, states=found.states, types=found.types), found
