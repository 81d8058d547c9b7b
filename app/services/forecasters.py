"""Who foretells what users will like: learned chains, and what is simpler."""

from collections.abc import Mapping
from dataclasses import replace

from learning.em import Spread
from learning.evaluation import BASELINES, BOOSTED, Forecaster
from learning.fitting import ChainForecaster, Recipe
from policies.mood import Mood

# The rate of likes of all plays of a user so far: a chain without mood may know it.
OWN_RATE = Mood(0, None, (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8), None)


def forecasters(
    recipe: Recipe, spread: Spread, *, boosted: bool
) -> Mapping[str, Forecaster]:
    """All of them by name; the first is what the others are compared with."""
    chains = {
        "chain, mood": replace(recipe, mood=Mood()),
        "chain, user rate": replace(recipe, mood=OWN_RATE),
        "chain": replace(recipe, mood=None),
    }
    learned = {name: ChainForecaster(each, spread) for name, each in chains.items()}
    return {**learned, **BASELINES, **(BOOSTED if boosted else {})}
