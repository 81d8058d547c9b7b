"""Models and situations to test on: the paper's, and random ones."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from policies import NEVER, Floats, Model, ModelSet, Signals, Situation, untouched

DATA = Path(__file__).parent / "data"


@dataclass(frozen=True)
class Instance:
    """Groups as plain lists, for the oracles; `situation` is the same, compiled."""

    models: tuple[Model, ...]
    rows: tuple[int, ...]
    beliefs: tuple[Floats, ...]
    counts: tuple[int, ...]

    def model(self, group: int) -> Model:
        return self.models[self.rows[group]]

    @property
    def situation(self) -> Situation:
        models = ModelSet.of(self.models)
        width = models.like.shape[1]
        padded = [np.pad(b, (0, width - len(b))) for b in self.beliefs]
        return situation(models, self.rows, np.array(padded), self.counts)


def situation(
    models: ModelSet, rows: Sequence[int], belief: Floats, counts: Sequence[int]
) -> Situation:
    made = Situation(
        models,
        np.array(rows, dtype=np.int64),
        belief,
        np.array(counts, dtype=np.int64),
        np.full(len(rows), NEVER),
    )
    made.check()
    return made


def paper(example: int) -> list[Model]:
    text = json.loads((DATA / f"example{example}.json").read_text())
    return [
        Model(
            text["states"],
            item["play"],
            item["rest"],
            item["like"],
            item["initial_belief"],
        )
        for item in text["items"]
    ]


def paper_situation(example: int) -> Situation:
    models = ModelSet.of(paper(example))
    return situation(models, range(5), untouched(models, 0), [1] * 5)


def paper_instance(example: int) -> Instance:
    models = paper(example)
    beliefs = tuple(model.prior for model in models)
    return Instance(tuple(models), tuple(range(5)), beliefs, (1,) * 5)


def random_model(rng: np.random.Generator, size: int) -> Model:
    return Model(
        [f"s{i}" for i in range(size)],
        rng.dirichlet(np.ones(size), size),
        rng.dirichlet(np.ones(size), size),
        rng.random(size),
        rng.dirichlet(np.ones(size)),
    )


def telling_model(rng: np.random.Generator, size: int, signals: int) -> Model:
    """A random model of that many states and signals."""
    return Model(
        [f"s{i}" for i in range(size)],
        rng.dirichlet(np.ones(size), size),
        rng.dirichlet(np.ones(size), size),
        None,
        rng.dirichlet(np.ones(size)),
        Signals(
            [f"y{k}" for k in range(signals)],
            rng.dirichlet(np.ones(signals), size),
            rng.random(signals),
        ),
    )


def random_models(seed: int, sizes: Sequence[int]) -> list[Model]:
    rng = np.random.default_rng(seed)
    return [random_model(rng, size) for size in sizes]


def uncertain(seed: int, samples: int, states: int = 3) -> Model:
    """Return a model that may be any of some random ones."""
    middle, *draws = random_models(seed, [states] * (samples + 1))
    return Model(
        middle.states,
        middle.play,
        middle.rest,
        middle.like,
        middle.prior,
        samples=draws,
    )


@st.composite
def instances(draw: DrawFn, most: int = 5) -> Instance:
    """Up to `most` groups of up to 3 items, of models of 2 to 4 states.

    Continuous parameters come from a generator, so that no two values tie by chance;
    some groups are twins of the one before, which tie exactly.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    sizes = draw(st.lists(st.integers(2, 4), min_size=1, max_size=3))
    models = tuple(random_model(rng, size) for size in sizes)
    rows: list[int] = []
    beliefs: list[Floats] = []
    for _ in range(draw(st.integers(1, most))):
        twin = bool(rows) and draw(st.booleans())
        row = rows[-1] if twin else draw(st.integers(0, len(models) - 1))
        belief = beliefs[-1] if twin else rng.dirichlet(np.ones(sizes[row]))
        rows.append(row)
        beliefs.append(belief)
    counts = tuple(draw(st.integers(1, 3)) for _ in rows)
    return Instance(models, tuple(rows), tuple(beliefs), counts)
