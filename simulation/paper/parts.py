"""What is simulated: the paper's four examples, and what lies beyond them.

A part takes one processor: they are simulated beside each other.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from policies import (
    Floats,
    Model,
    ModelSet,
    Situation,
    bound,
    rested,
    untouched,
    worth_for_ever,
)
from simulation.contender import Progress
from simulation.examples import DISCOUNT, Example, drawn, example, ordered
from simulation.listeners import Listeners
from simulation.opening import opening
from simulation.paper.instances import Drawings, averaged, over
from simulation.paper.labels import (
    EXACT,
    EXPECTED,
    FIXED,
    MYOPIC,
    PAPER,
    RANDOM,
    RANDOM_BASE,
    ROUND_ROBIN,
    SHIPPED,
    WHITTLE,
    WHITTLE_MC,
    entry,
)
from simulation.paper.rows import Part, Row, Trial

T = TypeVar("T")

BELIEF, STATE = "belief", "state"
DEPTHS = {1: 6, 2: 2, 3: 2}  # of the bound
TRAJECTORIES = (10, 30, 100, 300, 1000, 3000, 10_000)
ENOUGH = 1000  # trajectories with expected rewards
HORIZONS = range(1, 11)
CUTS = (1, 2, 3, 4, 5, 6, 8, 12)  # horizons of the Monte Carlo index
COUNTS = (5, 15, 50, 150, 500, 1000)  # of items
INSTANCES = 6  # of so many items
RUNS_OF_ITEMS = 20  # of each instance
MOST_TABLES = 50  # a table of each model is worked out; more would take minutes
WRONG = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5)  # share of parameters that is
LEAST_RUNS = 20
SHORT = 100  # slots, where policies are compared: later ones add 0.6 %
POINTS = 3000  # of the grids of their bounds


@dataclass(frozen=True, slots=True)
class Scale:
    """How much is simulated. `share`: of the runs of a full reproduction."""

    share: float = 1.0

    def runs(self, full: int) -> int:
        """Return how many of so many."""
        return max(round(self.share * full), LEAST_RUNS)

    def count(self, full: int) -> int:
        """Return how many of so many things that are never just one."""
        return max(round(self.share * full), 3)

    def thin(self, values: Sequence[T]) -> Sequence[T]:
        """Return all of some values, or every other one."""
        return values if self.share == 1 else values[::2]


def _example(
    number: int, scale: Scale, progress: Progress, others: Mapping[str, int]
) -> Part:
    """Try policies from both starts."""
    paper = example(number)
    fast = scale.runs(20_000)
    entries = [entry(label, fast) for label in (MYOPIC, WHITTLE, FIXED, RANDOM)]
    entries += [entry(label, scale.runs(runs)) for label, runs in others.items()]
    start = paper.start
    rows: list[Row] = []
    for half, (group, listeners) in enumerate(
        ((BELIEF, None), (STATE, paper.in_states(start)))
    ):
        trial = Trial(group, start, entries, listeners, in_full=True)
        rows += trial.rows(_within(progress, half, 2))
    depth = DEPTHS[number] if scale.share == 1 else 1
    return Part(f"example-{number}", rows, _marks(number, paper, depth))


def _within(progress: Progress, place: int, total: int) -> Progress:
    return lambda share: progress((place + share) / total)


def _marks(number: int, paper: Example, depth: int) -> Mapping[str, float]:
    """Return the upper bound, the best fixed item, and the optimum where it is known.

    Playing item 3 once and then item 4 for ever is optimal in example 2, playing item 1
    for ever in example 3: these values meet the bound.
    """
    start = paper.start
    fixed = worth_for_ever(start, DISCOUNT)
    later = worth_for_ever(_rested(start), DISCOUNT)
    third = float(start.belief[2] @ start.models.like[2])
    known = {2: third + DISCOUNT * float(later[3]), 3: float(fixed[0])}
    marks = {
        "bound": bound(start, DISCOUNT, depth).value,
        FIXED: float(fixed.max()),
    }
    return marks | ({"optimum": known[number]} if number in known else {})


def _rested(start: Situation) -> Situation:
    """Return the items after a slot of rest."""
    ones = np.ones(len(start.model), dtype=np.int64)
    belief = rested(start.models, start.model, start.belief, ones)
    return replace(start, belief=belief)


def example_1(scale: Scale, progress: Progress) -> Part:
    """Structure, it is said; and myopic ahead of rollout."""
    others = {PAPER: 1000, RANDOM_BASE: 500, EXPECTED: 1000, EXACT: 3000}
    others[SHIPPED] = 1000
    return _example(1, scale, progress, others)


def example_2(scale: Scale, progress: Progress) -> Part:
    """No structure; and rollout ahead."""
    others = {PAPER: 1000, RANDOM_BASE: 500, EXPECTED: 1000, EXACT: 3000}
    others[SHIPPED] = 1000
    return _example(2, scale, progress, others)


def example_3(scale: Scale, progress: Progress) -> Part:
    """Rest leads to the second state; and Whittle behind."""
    others = {PAPER: 1000, RANDOM_BASE: 500, EXPECTED: 1000, WHITTLE_MC: 300}
    others |= {EXACT: 3000, SHIPPED: 1000}
    return _example(3, scale, progress, others)


def noise(scale: Scale, progress: Progress) -> Part:
    """Example 1, by the number of trajectories."""
    start = example(1).start
    rows: list[Row] = []
    lengths = TRAJECTORIES if scale.share == 1 else TRAJECTORIES[:4]
    for place, trajectories in enumerate(lengths):
        both = {"clicks": PAPER, "expected": EXPECTED}
        for group, label in both.items():
            if group == "expected" and trajectories > ENOUGH:
                continue  # it has long come to rest
            runs = scale.runs(max(min(1000, 300_000 // trajectories), 60))
            entries = [
                entry(MYOPIC, runs),
                entry(label, runs, trajectories=trajectories),
            ]
            trial = Trial(group, start, entries, x=trajectories)
            rows += list(trial.rows())[1:]
        progress((place + 1) / len(lengths))
    trial = Trial("exact", start, [entry(MYOPIC, 3000), entry(EXACT, scale.runs(3000))])
    return Part("noise", [*rows, *trial.rows()])


def truncation(scale: Scale, progress: Progress) -> Part:
    """Example 3, by the horizon of the Monte Carlo index."""
    paper, rows = example(3), list[Row]()
    start = paper.start
    cuts = scale.thin(CUTS)
    for place, horizon in enumerate(cuts):
        runs = scale.runs(150)
        entries = [entry(MYOPIC, runs), entry(WHITTLE_MC, runs, horizon=horizon)]
        for group, listeners in ((BELIEF, None), (STATE, paper.in_states(start))):
            trial = Trial(group, start, entries, listeners, x=horizon)
            rows += list(trial.rows())[1:]
        progress((place + 1) / len(cuts))
    return Part("truncation", rows)


def example_4(scale: Scale, progress: Progress) -> Part:
    """Drawn instances of fifteen items."""
    drawings = Drawings("example-4", drawn, scale.count(200), scale.runs(25), POINTS)
    return over(drawings, progress)


def structure(scale: Scale, progress: Progress) -> Part:
    """Drawn instances of five items that have the structure the paper names."""
    few = partial(ordered, items=len(example(1).models))
    drawings = Drawings("structure", few, scale.count(200), scale.runs(50), POINTS)
    return over(drawings, progress)


def items(scale: Scale, progress: Progress) -> Part:
    """More and more drawn items, each with a model of its own; on average."""
    rows: list[Row] = []
    counts = scale.thin(COUNTS)
    for place, count in enumerate(counts):
        few = (WHITTLE, SHIPPED) if count <= scale.count(MOST_TABLES) else ()
        labels = (MYOPIC, EXPECTED, EXACT, *few)
        entries = [entry(label, scale.runs(RUNS_OF_ITEMS)) for label in labels]
        rows += averaged(
            [
                [
                    *Trial(
                        "items",
                        opening(drawn(seed, count)),
                        entries,
                        slots=SHORT,
                        x=count,
                        seed=seed,
                    ).rows()
                ]
                for seed in range(scale.count(INSTANCES))
            ]
        )
        progress((place + 1) / len(counts))
    return Part("items", rows)


def horizon(scale: Scale, progress: Progress) -> Part:
    """Further and further ahead, exactly."""
    rows: list[Row] = []
    lengths = scale.thin(HORIZONS)
    for place, length in enumerate(lengths):
        runs = scale.runs(2000 // length)
        for number in (1, 2, 3):
            entries = [entry(MYOPIC, runs), entry(EXACT, runs, horizon=length)]
            trial = Trial(f"example {number}", example(number).start, entries, x=length)
            rows += list(trial.rows())[1:]
        progress((place + 1) / len(lengths))
    return Part("horizon", rows)


def robustness(scale: Scale, progress: Progress) -> Part:
    """Example 2, planned with parameters that are ever more wrong."""
    true = example(2).models
    models = ModelSet.of(true)
    mistakes, runs = scale.count(12), scale.runs(60)
    labels = (MYOPIC, WHITTLE, EXACT, SHIPPED, FIXED, ROUND_ROBIN)
    rows: list[Row] = []
    shares = scale.thin(WRONG)
    for place, share in enumerate(shares):
        found: list[Sequence[Row]] = []
        for seed in range(mistakes):
            start = opening(mistaken(true, share, seed))
            listeners = Listeners(models, untouched(models, 0))
            entries = [entry(label, runs) for label in labels]
            trial = Trial(
                "robustness", start, entries, listeners, SHORT, share, seed=seed
            )
            found.append(list(trial.rows()))
        rows += averaged(found)
        progress((place + 1) / len(shares))
    return Part("robustness", rows)


def mistaken(models: Sequence[Model], share: float, seed: int) -> Sequence[Model]:
    """Mix what is true of models with chance: of that weight, in every row.

    Chances of a like move towards random ones as much.
    """
    rng = np.random.default_rng([seed, 7])

    def wrong(rows: Floats) -> Floats:
        ones = np.ones(rows.shape[-1])
        mixed: Floats = (1 - share) * rows + share * rng.dirichlet(
            ones, rows.shape[:-1]
        )
        return mixed

    return [
        Model(
            model.states,
            wrong(model.play),
            wrong(model.rest),
            (1 - share) * model.like + share * rng.random(len(model.like)),
            wrong(model.prior),
        )
        for model in models
    ]


PARTS: Mapping[str, Callable[[Scale, Progress], Part]] = MappingProxyType(
    {
        "example-1": example_1,
        "noise": noise,
        "structure": structure,
        "example-2": example_2,
        "example-3": example_3,
        "truncation": truncation,
        "example-4": example_4,
        "items": items,
        "horizon": horizon,
        "robustness": robustness,
    }
)
