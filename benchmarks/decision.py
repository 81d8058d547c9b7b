"""How long a decision takes, beside plain versions of the same rollout.

Run as `python -m benchmarks.decision`. All versions take turns in one process, on one
thread each; the figures are medians over rounds. `benchmarks/plain.py` holds the plain
versions: (a) the paper's rollout in NumPy, (b) the exact tree in Numba, item by item.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy reads it

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks import plain
from benchmarks.machine import describe
from policies import (
    NEVER,
    Floats,
    Mixture,
    Model,
    ModelSet,
    Situation,
    build,
    choose,
    create,
    ready,
    untouched,
)

STATES, HORIZON, TRAJECTORIES, DISCOUNT = 4, 5, 100, 0.95
ROUNDS, SLICE = 9, 0.02
PLAYED, UNTOUCHED = 300, 50
AIMS = {5: "35 us", 15: "100 us", 100: ".5 ms", 500: "1.5 ms"}


@dataclass(frozen=True)
class Case:
    """A policy and a situation: distinct beliefs, and perhaps untouched items."""

    policy: str
    beliefs: int
    aim: str = "-"
    params: dict[str, object] = field(default_factory=dict)
    untouched: int = 0
    compare: bool = False

    @property
    def name(self) -> str:
        options = "".join(f", {name} {value}" for name, value in self.params.items())
        items = f"{self.beliefs} beliefs"
        if self.untouched:
            items = f"{self.untouched:,} items, {PLAYED} touched".replace(",", " ")
        return f"{self.policy}{options}, {items}"


PLAIN: dict[str, object] = {"base": "myopic", "horizon": HORIZON, "leaf": "none"}
CASES = [
    Case("myopic", 5, "20 us"),
    *(Case("exact_rollout", beliefs) for beliefs in (5, 15, 100, 500)),
    *(
        Case("exact_rollout", beliefs, aim, PLAIN, compare=True)
        for beliefs, aim in (
            (5, "35 us"),
            (15, "100 us"),
            (100, ".5 ms"),
            (500, "1.5 ms"),
        )
    ),
    *(
        Case("exact_rollout", PLAYED + UNTOUCHED, "2 ms", untouched=10**power)
        for power in (3, 4, 5, 6)
    ),
    Case("exact_rollout", PLAYED + UNTOUCHED, "2 ms", PLAIN, untouched=10**6),
    Case("exact_rollout", 15, params={"horizon": 5}),
    Case("exact_rollout", 15, params={"depth": 2, "horizon": 1}),
    Case("whittle", 5, "5 us"),
    Case("whittle", 500, "100 us"),
    Case("lagrangian", 15),
    Case("rollout", 5, "250 us", compare=True),
    Case("rollout", 100, "10 ms", compare=True),
    Case("rollout", 5, params={"base": "random"}),
    Case("whittle_mc", 5),
]


def instance(case: Case) -> Situation:
    """Draw models and beliefs; of a large catalogue, most items are untouched."""
    rng = np.random.default_rng(case.beliefs)
    rows = np.ones(STATES)
    models = ModelSet.of(
        [
            Model(
                ("low", "medium", "high", "very high"),
                rng.dirichlet(rows, STATES),
                rng.dirichlet(rows, STATES),
                np.sort(rng.random(STATES)),
                rng.dirichlet(rows),
            )
            for _ in range(min(case.beliefs, UNTOUCHED))
        ]
    )
    model = np.arange(case.beliefs) % len(models.states)
    belief = rng.dirichlet(rows, case.beliefs)
    count = np.ones(case.beliefs, dtype=np.int64)
    if case.untouched:
        belief[PLAYED:] = untouched(models, 0)[model[PLAYED:]]
        count[PLAYED:] = (case.untouched - PLAYED) // UNTOUCHED
    return Situation(models, model, belief, count, np.full(case.beliefs, NEVER))


def per_call(run: Callable[[], object]) -> float:
    """Return microseconds per call over a short slice of time, at least one call."""
    calls, start = 0, time.perf_counter()
    while calls == 0 or time.perf_counter() - start < SLICE:
        run()
        calls += 1
    return (time.perf_counter() - start) / calls * 1e6


def measured(case: Case) -> Sequence[float | None]:
    """Return medians of ours, of NumPy and of plain Numba."""
    given = instance(case)
    scorer = ready(create(case.policy, case.params), given.models)
    models, rng = plain.models_of(given), np.random.default_rng(0)

    def ours() -> None:
        situation = Situation(
            given.models, given.model, given.belief, given.count, given.rested
        )
        choose(scorer(situation, 1), situation.count, 1)

    def in_numpy() -> Floats:
        return plain.sampled(
            models, given.belief, rng, "myopic", HORIZON, TRAJECTORIES, DISCOUNT
        )

    def in_numba() -> Floats:
        return plain.exact(models, given.belief, HORIZON, DISCOUNT)

    runs: list[Callable[[], object]] = [ours]
    if case.compare:
        agree(scorer(given, 1), in_numba())
        runs += [in_numpy, in_numba]
    rounds = [
        [per_call(run) for run in runs]
        for _ in range(ROUNDS if case.beliefs < 100 else 3)
    ]
    medians = [statistics.median(times) for times in zip(*rounds, strict=True)]
    return medians if case.compare else [*medians, None, None]


def agree(scores: Floats | Mixture, exact: Floats) -> None:
    """Check that both versions would play the same, or nearly so."""
    assert not isinstance(scores, Mixture)
    assert exact.max() - exact[scores.argmax()] < 0.1


def tables() -> float:
    """Return seconds to build the index table of a model."""
    models = instance(Case("whittle", 5)).models
    times = []
    for m in range(5):
        start = time.perf_counter()
        build(models, m, DISCOUNT)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def shown(microseconds: float | None) -> str:
    if microseconds is None:
        return "-"
    if microseconds < 1000:
        return f"{microseconds:.1f} us"
    return f"{microseconds / 1000:.2f} ms"


def ratio(ours: float, theirs: float | None) -> str:
    return "-" if theirs is None else f"{theirs / ours:.0f}"


def main() -> None:
    print(describe())
    print(f"H = {HORIZON}, L = {TRAJECTORIES}, S = {STATES} unless said otherwise\n")
    heads = ("ours", "aim", "NumPy", "ratio", "plain Numba", "ratio")
    print(f"{'one decision':<58}" + "".join(f"{head:>12}" for head in heads))
    for case in CASES:
        ours, numpys, numbas = measured(case)
        assert ours is not None
        cells = (
            shown(ours),
            case.aim,
            shown(numpys),
            ratio(ours, numpys),
            shown(numbas),
            ratio(ours, numbas),
        )
        print(f"{case.name:<58}" + "".join(f"{cell:>12}" for cell in cells), flush=True)
    print(f"\nindex table of a model, default grid: {tables():.2f} s (aim 1 s)")


if __name__ == "__main__":
    main()
