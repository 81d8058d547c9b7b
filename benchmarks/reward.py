"""What policies earn, and how much any policy could: the paper's examples, and others.

Run as `python -m benchmarks.reward`, for hours; `--examples` and `--instances` choose
parts of it. Every policy of an example meets the same random numbers. Values are
discounted rewards from a start where hidden states follow the beliefs, each play scored
by its expected reward; what comes after the last slot is left out.
"""

import argparse
import statistics
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import hypot

import numpy as np

from benchmarks.machine import describe
from policies import (
    Floats,
    Situation,
    bound,
    create,
)
from simulation import (
    Contender,
    Course,
    contenders,
    drawn,
    example,
    opening,
    remainder,
    standard_error,
    value,
)
from simulation.examples import DISCOUNT, ITEMS

SEED = 1
DEPTHS = {1: 6, 2: 2, 3: 2}  # of the bound
MANY, FEWER, FEW = 10, 5, 40  # times as many runs where scoring is fast; as few if not
SLOTS, SHORT = 240, 120  # of the paper's examples and of random instances
PAIRS = [(0, 2), (0, 3), (1, 2), (1, 3)]  # of players of random instances
NOTABLE = 2.0  # standard errors
ROUNDS = 5  # of more runs, which double

Named = tuple[str, str, Mapping[str, object]]


def rollout(label: str, **params: object) -> Named:
    return f"exact_rollout, {label}", "exact_rollout", params


DEFAULT: Named = ("exact_rollout", "exact_rollout", {})
BOUNDED = rollout("base whittle", base="whittle")
FAST: Sequence[Named] = [
    ("myopic", "myopic", {}),
    ("whittle", "whittle", {}),
    ("random", "random", {}),
    ("round_robin", "round_robin", {}),
    ("best_fixed", "best_fixed", {}),
]
SLOW: Sequence[Named] = [DEFAULT]
SLOWEST: Sequence[Named] = [
    BOUNDED,
    rollout("base myopic", base="myopic"),
    rollout("base myopic, H 5, no leaf", base="myopic", horizon=5, leaf="none"),
    rollout("base whittle, H 5, no leaf", base="whittle", horizon=5, leaf="none"),
    rollout("base whittle, H 5, leaf base", base="whittle", horizon=5, leaf="base"),
    rollout("depth 2, H 1", depth=2, horizon=1),
    ("lagrangian", "lagrangian", {}),
    ("rollout", "rollout", {}),
    ("rollout, preset paper", "rollout", {"preset": "paper"}),
    ("whittle_mc", "whittle_mc", {}),
]
PLAYERS: Sequence[Named] = [
    DEFAULT,
    BOUNDED,
    ("whittle", "whittle", {}),
    ("myopic", "myopic", {}),
]


@dataclass(frozen=True)
class Estimate:
    mean: float
    error: float

    @property
    def sigmas(self) -> float:
        """The mean in standard errors; equal rewards in all runs are none."""
        return self.mean / self.error if self.error > 0 else 0.0

    @classmethod
    def of(cls, rewards: Floats) -> "Estimate":
        return cls(float(rewards.mean()), standard_error(rewards))

    def __str__(self) -> str:
        return f"{self.mean:.4f} ± {1.96 * self.error:.4f}"


def ready(named: Sequence[Named], start: Situation) -> Sequence[Contender]:
    policies = [create(name, params) for _, name, params in named]
    return contenders(policies, start.models)


def show_example(number: int, runs: int) -> None:
    start, slots = example(number).start, SLOTS
    certified = bound(start, DISCOUNT, DEPTHS[number]).value
    left = remainder(start, Course(runs, slots, DISCOUNT, SEED))
    print(f"\nexample {number}: no policy earns more than {certified:.6f}")
    print(f"{MANY * runs} runs of the first {len(FAST)}; {runs // FEWER}, of the last")
    print(f"{len(SLOWEST)} {runs // FEW}, of others, by their difference to `whittle`;")
    print(f"{slots} slots, after which at most {left:.4f} is earned; seed {SEED}\n")
    print("| policy | reward | above `whittle` | above `myopic` | gap | a decision |")
    print("| --- | --- | --- | --- | --- | --- |")
    named = [*FAST, *SLOW, *SLOWEST]
    players = ready(named, start)
    fast = value(
        players[: len(FAST)], start, Course(MANY * runs, slots, DISCOUNT, SEED)
    )
    myopic, whittle = (each.rewards for each in fast[:2])
    lengths = [runs // FEWER] * len(SLOW) + [runs // FEW] * len(SLOWEST)
    slow = (
        value([player], start, Course(length, slots, DISCOUNT, SEED))[0]
        for player, length in zip(players[len(FAST) :], lengths, strict=True)
    )
    labels = [label for label, *_ in named]
    for label, found in zip(labels, chain(fast, slow), strict=True):
        own = lifted(found.rewards, whittle)
        above = [
            Estimate.of(found.rewards - other[: len(found.rewards)])
            for other in (whittle, myopic)
        ]
        gap = 100 * (1 - own.mean / certified)
        print(f"| {label} | {own} | {above[0]} | {above[1]} ", end="")
        print(f"| {gap:.2f} % | {found.decision_us:.0f} µs |", flush=True)


def lifted(rewards: Floats, reference: Floats) -> Estimate:
    """Estimate a mean by that of a reference over more runs, and the difference."""
    if len(rewards) == len(reference):
        return Estimate.of(rewards)
    many = Estimate.of(reference)
    difference = Estimate.of(rewards - reference[: len(rewards)])
    return Estimate(many.mean + difference.mean, hypot(many.error, difference.error))


def show_instances(instances: int, runs: int) -> None:
    """Compare `exact_rollout` with both index policies."""
    print(f"\n{instances} random instances of {ITEMS} items; {runs} runs, up to")
    print(
        f"{runs * 2 ** (ROUNDS - 1)} while one is more than {NOTABLE} standard errors"
    )
    print(f"below another; {SHORT} slots; seeds from 0\n")
    print("| | least | median | greatest | worst instance |")
    print("| --- | --- | --- | --- | --- |", flush=True)
    found = [compared(number, runs) for number in range(instances)]
    for place, (above, below) in enumerate(PAIRS):
        name = f"{PLAYERS[above][0]} above {PLAYERS[below][0]}"
        pairs = [each.above[place] for each in found]
        worst = min(pairs, key=lambda estimate: estimate.sigmas)
        means = spread([estimate.mean for estimate in pairs], ".4f")
        print(f"| {name} | {means} | {worst}, {worst.sigmas:.1f} SE |")
    print(f"| gap to the bound, % | {spread([each.gap for each in found], '.2f')} | |")
    longer = [number for number, each in enumerate(found) if each.runs > runs]
    print(f"\nwith more runs: {longer or 'none'}", flush=True)


def spread(values: Sequence[float], form: str) -> str:
    shown = (min(values), statistics.median(values), max(values))
    return " | ".join(format(number, form) for number in shown)


@dataclass(frozen=True)
class Compared:
    """One instance: paired differences of PAIRS; gap of the first player in percent."""

    above: Sequence[Estimate]
    gap: float
    runs: int


def compared(number: int, runs: int) -> Compared:
    start = opening(drawn(number))
    players, rewards = ready(PLAYERS, start), np.empty((len(PLAYERS), 0))
    above: list[Estimate] = []
    for turn in range(ROUNDS):
        if all(estimate.sigmas >= -NOTABLE for estimate in above) and above:
            break
        course = Course(max(rewards.shape[1], runs), SHORT, DISCOUNT, SEED + turn)
        found = value(players, start, course)
        rewards = np.append(rewards, [each.rewards for each in found], axis=1)
        above = [Estimate.of(rewards[one] - rewards[two]) for one, two in PAIRS]
    certified = bound(start, DISCOUNT, depth=1).value
    gap = 100 * (1 - float(rewards[0].mean()) / certified)
    note = ", ".join(f"{estimate} ({estimate.sigmas:+.1f} SE)" for estimate in above)
    print(f"instance {number}: {note}, gap {gap:.2f} %", file=sys.stderr, flush=True)
    return Compared(above, gap, rewards.shape[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, nargs="*", default=[1, 2, 3])
    parser.add_argument("--runs", type=int, default=20_000)
    parser.add_argument("--instances", type=int, default=100)
    parser.add_argument("--instance-runs", type=int, default=200)
    options = parser.parse_args()
    print(describe())
    for number in options.examples:
        show_example(number, options.runs)
    if options.instances:
        show_instances(options.instances, options.instance_runs)


if __name__ == "__main__":
    main()
