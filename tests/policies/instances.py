"""Models and situations to test on: the paper's, and random ones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from policies import (
    NEUTRAL,
    NEVER,
    Floats,
    Ints,
    Model,
    ModelSet,
    Mood,
    MoodState,
    Signals,
    Situation,
    Slate,
    Tables,
    build,
    mood_of,
)
from simulation.examples import example


@dataclass(frozen=True)
class Instance:
    """Groups as plain lists, for the oracles; `situation` is the same, compiled."""

    models: tuple[Model, ...]
    rows: tuple[int, ...]
    beliefs: tuple[Floats, ...]
    counts: tuple[int, ...]
    rested: tuple[int, ...] = ()
    plays: int = 1
    chosen: tuple[tuple[int, Floats], ...] = ()
    answers: tuple[int, ...] = ()
    resumed: bool = False

    def model(self, group: int) -> Model:
        return self.models[self.rows[group]]

    @property
    def since(self) -> tuple[int, ...]:
        """Slots of rest of each group; without further notice never played."""
        return self.rested or (NEVER,) * len(self.rows)

    @property
    def situation(self) -> Situation:
        models = ModelSet.of(self.models)
        width = models.like.shape[1]
        made = situation(models, self.rows, padded(self.beliefs, width), self.counts)
        return replace(
            made,
            rested=np.array(self.since, dtype=np.int64),
            slate=Slate(
                self.plays,
                np.array([row for row, _ in self.chosen], dtype=np.int64),
                padded([belief for _, belief in self.chosen], width),
            ),
            mood=self.mood,
            resumed=self.resumed,
        )

    @property
    def mood(self) -> MoodState:
        """What the answers so far have led to."""
        mood, state = mood_of(self.models), NEUTRAL
        for answer in self.answers if mood else ():
            state = mood.after(state, answer)  # type: ignore[union-attr]
        return state


def padded(beliefs: Sequence[Floats], width: int) -> Floats:
    rows = [np.pad(belief, (0, width - len(belief))) for belief in beliefs]
    return np.array(rows).reshape(len(rows), width)


def arrays_of(models: ModelSet) -> dict[str, Floats | Ints]:
    found = models._asdict()
    return {name: array for name, array in found.items() if name != "classes"}


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


def paper(number: int) -> list[Model]:
    return list(example(number).models)


def paper_situation(number: int) -> Situation:
    return example(number).start


def paper_instance(number: int) -> Instance:
    models = example(number).models
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


NAMES = ("a", "b", "c")
# Nothing is left to chance. At a discount of .9 and a subsidy of .5, "b" rests, to be
# played for ever as "c": .5 + .9 8 > 1 + .81 8. At .1 and at .9 it is played: 1 + .81 8
# and 1 + .9 9 are more than .1 + .9 8 and 9.
NOT_INDEXABLE = Model(
    NAMES,
    [[0, 0, 1], [1, 0, 0], [0, 0, 1]],
    [[1, 0, 0], [0, 0, 1], [0, 1, 0]],
    None,
    [0, 1, 0],
    Signals(NAMES, np.eye(3), [0, 1, 0.8]),
)


def rough_tables(models: ModelSet, discount: float) -> Tables:
    """Tables on coarse grids, which are built at once."""
    rows = range(len(models.states))
    return Tables.of([build(models, m, discount, 300) for m in rows], discount)


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
def instances(draw: DrawFn, most: int = 5, signals: Sequence[int] = ()) -> Instance:
    """Up to `most` groups of up to 3 items, of models of 2 to 4 states.

    Continuous parameters come from a generator, so that no two values tie by chance;
    some groups are twins of the one before, which tie exactly. Models have as many
    signals as one of `signals`, or else a skip and a like.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    sizes = draw(st.lists(st.integers(2, 4), min_size=1, max_size=3))
    models = tuple(
        telling_model(rng, size, draw(st.sampled_from(signals)))
        if signals
        else random_model(rng, size)
        for size in sizes
    )
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


@st.composite
def slates(
    draw: DrawFn, most: int = 4, signals: Sequence[int] = (), most_plays: int = 3
) -> Instance:
    """Instances of up to `most_plays` plays a slot, of which some are chosen already.

    Groups have rested for a while, or were never played.
    """
    instance = draw(instances(most, signals))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    plays = draw(st.integers(1, most_plays))
    models = st.integers(0, len(instance.models) - 1)
    chosen = draw(st.lists(models, max_size=plays - 1))
    return replace(
        instance,
        rested=tuple(draw(st.sampled_from([0, 1, 5, NEVER])) for _ in instance.rows),
        plays=plays,
        chosen=tuple(
            (row, rng.dirichlet(np.ones(len(instance.models[row].states))))
            for row in chosen
        ),
    )


MOODS = st.builds(
    Mood,
    answers=st.integers(0, 2),
    memory=st.sampled_from([None, 1.0, 3.0]),
    levels=st.sampled_from([(), (0.5,), (0.3, 0.6)]),
    pause_s=st.sampled_from([None, 1800.0]),
)


def moody(model: Model, mood: Mood, rng: np.random.Generator) -> Model:
    """Return the model with other chances in each mood, each met by its share."""
    states, signals = model.observe.shape
    return Model(
        model.states,
        model.play,
        model.rest,
        None,
        model.prior,
        Signals(
            model.signals,
            rng.dirichlet(np.ones(signals), (mood.classes, states)),
            model.reward,
        ),
        mood=mood,
        shares=rng.dirichlet(np.ones(mood.classes)),
    )


def even_tempered(model: Model, mood: Mood | None) -> Model:
    """Return a model of likes and skips with a mood that changes nothing, or none.

    In either case its rows are normalised once more.
    """
    return Model(
        model.states,
        model.play,
        model.rest,
        np.tile(model.like, (mood.classes, 1)) if mood else model.like,
        model.prior,
        samples=[even_tempered(sample, mood) for sample in model.samples],
        mood=mood,
    )


@st.composite
def moods(draw: DrawFn, without: st.SearchStrategy[Instance]) -> Instance:
    """Instances whose models have a mood, but perhaps the last one, in any mood."""
    instance, mood = draw(without), draw(MOODS)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kept = len(instance.models) - draw(st.integers(0, 1))
    models = [
        moody(model, mood, rng) if m < max(kept, 1) else model
        for m, model in enumerate(instance.models)
    ]
    return replace(
        instance,
        models=tuple(models),
        answers=tuple(draw(st.lists(st.integers(0, 1), max_size=5))),
        resumed=mood.pause_s is not None and draw(st.booleans()),
    )
