"""How long a decision takes, beside a plain NumPy version of the same rollout.

Run as `python -m benchmarks.decision`. Both versions take turns in one process, on one
thread each; the figures are medians over rounds. The NumPy version carries the beliefs
of all items in arrays, vectorised over trajectories; it shares no code with `policies`.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy reads it

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.machine import describe
from policies import (
    NEVER,
    Floats,
    Mixture,
    Model,
    ModelSet,
    Policy,
    Situation,
    choose,
    create,
    ready,
    untouched,
    warm_up,
)

STATES, HORIZON, TRAJECTORIES, DISCOUNT = 4, 5, 100, 0.95
ROUNDS, SLICE = 9, 0.02


@dataclass(frozen=True)
class Case:
    name: str
    policy: str
    params: dict[str, object]
    groups: int
    items: int
    aim: str
    naive: bool = True


CASES = [
    Case("myopic, 5 items", "myopic", {}, 5, 1, "20 us"),
    Case("rollout, 5 items", "rollout", {}, 5, 1, "250 us"),
    Case("rollout, 15 items", "rollout", {}, 15, 1, "-"),
    Case("rollout, 100 items", "rollout", {}, 100, 1, "10 ms"),
    Case("rollout, random base, 5 items", "rollout", {"base": "random"}, 5, 1, "-"),
    Case("rollout, 1 000 300 items *", "rollout", {}, 350, 20_000, "-"),
    Case(
        "rollout, H = 50, 5 items", "rollout", {"horizon": 50}, 5, 1, "-", naive=False
    ),
]


def instance(case: Case) -> Situation:
    """Draw models; of a large catalogue, 300 items were played and 50 models not."""
    rng = np.random.default_rng(case.groups)
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
            for _ in range(case.groups)
        ]
    )
    count = np.ones(case.groups, dtype=np.int64)
    count[300:] = case.items
    belief = untouched(models, 0)
    never = np.full(case.groups, NEVER)
    return Situation(models, np.arange(case.groups), belief, count, never)


def naive_myopic(situation: Situation) -> int:
    likes = situation.models.like[situation.model]
    return int((situation.belief * likes).sum(axis=1).argmax())


def naive_rollout(situation: Situation, rng: np.random.Generator, base: str) -> Floats:
    """Score items one after the other, all trajectories at once: (N, L, S) beliefs."""
    models, items = situation.models, len(situation.model)
    lines = np.arange(TRAJECTORIES)
    scores = np.empty(items)
    for first in range(items):
        imagined = np.repeat(situation.belief[:, None, :], TRAJECTORIES, axis=1)
        total = np.zeros(TRAJECTORIES)
        played = np.full(TRAJECTORIES, first)
        for h in range(HORIZON + 1):
            chances = (imagined * models.like[:, None, :]).sum(axis=2)  # (N, L)
            if h > 0 and base == "myopic":
                played = chances.argmax(axis=0)
            elif h > 0:
                played = rng.integers(items, size=TRAJECTORIES)
            chance = chances[played, lines]
            total += DISCOUNT**h * chance
            liked = rng.random(TRAJECTORIES) < chance
            like = models.like[played]
            weights = imagined[played, lines] * np.where(liked[:, None], like, 1 - like)
            after = (weights[:, None, :] @ models.play[played])[:, 0]
            imagined = imagined @ models.rest
            imagined[played, lines] = after / weights.sum(axis=1, keepdims=True)
        scores[first] = total.mean()
    return scores


def per_call(run: Callable[[], object]) -> float:
    """Return microseconds per call over a short slice of time, at least one call."""
    calls, start = 0, time.perf_counter()
    while calls == 0 or time.perf_counter() - start < SLICE:
        run()
        calls += 1
    return (time.perf_counter() - start) / calls * 1e6


def measured(case: Case) -> tuple[float, float | None]:
    """Return medians of ours and of the NumPy version."""
    given = instance(case)
    policy: Policy = create(case.policy, case.params)
    scorer = ready(policy, given.models)
    rng = np.random.default_rng(0)

    def ours() -> None:
        situation = Situation(
            given.models, given.model, given.belief, given.count, given.rested
        )
        choose(scorer(situation, 1), situation.count, 1)

    def theirs() -> None:
        if case.policy == "myopic":
            naive_myopic(given)
        else:
            int(naive_rollout(given, rng, base(case)).argmax())

    scores = scorer(given, 1)
    assert not isinstance(scores, Mixture)
    agree(case, scores, given)
    rounds = ROUNDS if case.groups < 200 else 2
    pairs = [
        (per_call(ours), per_call(theirs) if case.naive else None)
        for _ in range(rounds)
    ]
    numpys = [naive for _, naive in pairs if naive is not None]
    ours_us = statistics.median(own for own, _ in pairs)
    return ours_us, statistics.median(numpys) if numpys else None


def base(case: Case) -> str:
    return str(case.params.get("base", "myopic"))


def agree(case: Case, scores: Floats, given: Situation) -> None:
    """Check that both versions estimate the same scores, where that is quick."""
    if case.policy == "rollout" and case.naive and case.groups < 50:
        rng = np.random.default_rng(1)
        runs = [naive_rollout(given, rng, base(case)) for _ in range(20)]
        assert np.abs(scores - np.mean(runs, axis=0)).max() < 0.15


def shown(microseconds: float | None) -> str:
    if microseconds is None:
        return "-"
    if microseconds < 1000:
        return f"{microseconds:.1f} us"
    return f"{microseconds / 1000:.2f} ms"


def main() -> None:
    warm_up()
    print(describe())
    print(f"H = {HORIZON}, L = {TRAJECTORIES}, S = {STATES} unless said otherwise\n")
    print(f"{'one decision':<32}{'ours':>12}{'NumPy':>12}{'ratio':>8}{'aim':>10}")
    for case in CASES:
        ours, numpys = measured(case)
        ratio = f"{numpys / ours:.0f}" if numpys else "-"
        print(f"{case.name:<32}{shown(ours):>12}{shown(numpys):>12}", end="")
        print(f"{ratio:>8}{case.aim:>10}", flush=True)
    print("\n* 300 played, 50 models of 20 000 more; NumPy is given one item for each")
    print("  of the 350 groups: all of them would take 3 GB of beliefs.")


if __name__ == "__main__":
    main()
