"""How fast runs are simulated: 20 000 of 120 slots, of the paper's example 1.

Run as `python -m benchmarks.simulation`. Compiles and builds index tables beforehand.
"""

import argparse
import time
from collections.abc import Mapping, Sequence

from benchmarks.machine import describe
from policies import create
from simulation import Course, contenders, example, value
from simulation.examples import DISCOUNT

SLOTS, SEED = 120, 1
Named = tuple[str, str, Mapping[str, object]]
ROLLOUT = {"base": "myopic", "horizon": 5, "leaf": "none"}
POLICIES: Sequence[Named] = [
    ("myopic", "myopic", {}),
    ("whittle", "whittle", {}),
    ("exact_rollout, H 5, base myopic, no leaf", "exact_rollout", ROLLOUT),
    ("exact_rollout, H 5", "exact_rollout", {"horizon": 5}),
    ("exact_rollout", "exact_rollout", {}),
]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20_000)
    runs = parser.parse_args().runs
    start = example(1).start
    ready = contenders([create(name, dict(p)) for _, name, p in POLICIES], start.models)
    value(ready, start, Course(4, SLOTS, DISCOUNT, SEED))
    print(f"{describe()}\n{runs} runs of {SLOTS} slots, seed {SEED}\n")
    print("| policy | time | a play, on all cores |")
    print("| --- | --- | --- |")
    for (label, _, _), contender in zip(POLICIES, ready, strict=True):
        began = time.perf_counter()
        value([contender], start, Course(runs, SLOTS, DISCOUNT, SEED))
        took = time.perf_counter() - began
        each = 1e6 * took / runs / SLOTS
        print(f"| {label} | {took:.1f} s | {each:.1f} µs |", flush=True)


if __name__ == "__main__":
    main()
