"""Where the listeners come from: catalogues of item models, and mistakes about them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from policies import Floats, Model

ITEMS = 15
STATES = ("low", "medium", "high", "very high")
EVEN = np.ones(len(STATES))

Chance = np.random.Generator
Seed = np.random.SeedSequence


@dataclass(frozen=True)
class World:
    """A kind of item: `draw` makes the model of one."""

    number: int
    says: str
    draw: Callable[[Chance], Model]

    def catalogue(self, seed: Seed) -> list[Model]:
        rng = np.random.default_rng(seed)
        return [self.draw(rng) for _ in range(ITEMS)]


def static(rng: Chance) -> Model:
    stays = np.eye(len(STATES))
    return Model(STATES, stays, stays, rising(rng), rng.dirichlet(EVEN))


def satiation(rng: Chance) -> Model:
    """Draw how soon plays tire (one state down or two) and how slowly rest restores."""
    tires, restores = rng.uniform(0.3, 0.7), rng.uniform(0.05, 0.25)
    play = falling([1 - tires, 0.8 * tires, 0.2 * tires])
    rest = falling([1 - restores, restores])[::-1, ::-1]
    return Model(STATES, play, rest, rising(rng), rng.dirichlet(EVEN))


def arbitrary(rng: Chance) -> Model:
    size = len(STATES)
    play, rest = rng.dirichlet(EVEN, size), rng.dirichlet(EVEN, size)
    return Model(STATES, play, rest, rng.random(size), rng.dirichlet(EVEN))


def rising(rng: Chance) -> Floats:
    """Draw the chance of a like in each state, lowest first."""
    return np.sort(rng.random(len(STATES)))


def falling(steps: Sequence[float]) -> Floats:
    """Move down by 0, 1, ... states with the chances `steps`, to the lowest at most."""
    matrix = np.zeros((len(STATES), len(STATES)))
    for state in range(len(STATES)):
        for step, chance in enumerate(steps):
            matrix[state, max(state - step, 0)] += chance
    return matrix


WORLDS: Mapping[str, World] = MappingProxyType(
    {
        "static": World(0, "taste never moves", static),
        "satiation": World(1, "plays tire, rest restores", satiation),
        "arbitrary": World(2, "random rows, no structure", arbitrary),
    }
)


def mistaken(models: Sequence[Model], share: float, seed: Seed) -> list[Model]:
    """Return models that are wrong by `share`.

    Every row of both matrices and the prior are mixed with a random distribution that
    has weight `share`; every chance of a like is multiplied by a random factor from
    1 - `share` to 1 + `share`, and clipped. Mistakes of one seed differ only in size.
    """
    rng = np.random.default_rng(seed)
    return [wrong(model, share, rng) for model in models]


def wrong(model: Model, share: float, rng: Chance) -> Model:
    def mixed(rows: Floats) -> Floats:
        noise = rng.dirichlet(EVEN, rows.shape[:-1])
        return np.asarray((1 - share) * rows + share * noise)

    factor = 1 + share * rng.uniform(-1, 1, len(STATES))
    like = np.clip(model.like * factor, 0, 1)
    return Model(STATES, mixed(model.play), mixed(model.rest), like, mixed(model.prior))
