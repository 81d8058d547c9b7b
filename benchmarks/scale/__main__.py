"""What a request costs as users, played items and the catalogue grow.

    python -m benchmarks.scale [--quick] [--databases sqlite postgresql] [--figure FILE]

One server on the first core, the load and PostgreSQL on the other; pairs of `next` and
`feedback` by one connection, of users all over the table, policy `myopic`. Also what it
takes to import a catalogue, and to start and serve with it.
"""

import argparse
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.machine import describe
from benchmarks.population import Population
from benchmarks.scale.costs import Cost, measured

DATABASES = ("sqlite", "postgresql")
LOGGED = 5  # plays of each user that the log still holds: it is for the disk's sake
BASE = Population(10_000, 50, 1000, LOGGED)
WHOLE = {
    "users": (1_000, 10_000, 100_000, 1_000_000),
    "played": (10, 50, 100, 300, 1_000),
    "items": (100, 1_000, 10_000, 100_000, 1_000_000),
}
QUICK = {
    "users": (1_000, 10_000),
    "played": (10, 50, 200),
    "items": (100, 1_000, 10_000),
}
HEADS = (
    *("users", "played", "items", "next p50", "feedback p50", "CPU a request"),
    *("import of items", "its memory", "start", "memory of the server"),
)


def points(sizes: Mapping[str, Sequence[int]]) -> Iterator[tuple[str, Population]]:
    """One thing grows, the others stay as they are."""
    for axis, numbers in sizes.items():
        for number in numbers:
            yield axis, replace(BASE, **{axis: number})


def row(population: Population, cost: Cost) -> Sequence[str]:
    return (
        *(f"{n:_}" for n in (population.users, population.played, population.items)),
        *(f"{cost.next_ms:.2f} ms", f"{cost.feedback_ms:.2f} ms"),
        *(f"{cost.cpu_us:.0f} µs", f"{cost.imported.seconds:.1f} s"),
        *(f"{cost.imported.megabytes:.0f} MB", f"{cost.started:.1f} s"),
        f"{cost.megabytes:.0f} MB",
    )


def table(cells: Sequence[str]) -> None:
    print(f"| {' | '.join(cells)} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes only")
    parser.add_argument("--databases", nargs="+", choices=DATABASES, default=DATABASES)
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--figure", type=Path, help="where to draw it: an SVG")
    options = parser.parse_args()
    os.sched_setaffinity(0, {1})
    print(describe())
    sizes, found = QUICK if options.quick else WHOLE, []
    for kind in options.databases:
        print(f"\n{kind}\n")
        table(HEADS)
        table(["---"] * len(HEADS))
        known: dict[Population, Cost] = {}
        for axis, population in points(sizes):
            if population not in known:
                known[population] = measured(kind, population, options.seconds)
                table(row(population, known[population]))
            number = getattr(population, axis)
            found.append((kind, axis, number, known[population]))
    if options.figure is not None:
        from benchmarks.scale.figure import draw  # noqa: PLC0415 - of an extra

        draw(found, options.figure)


if __name__ == "__main__":
    main()
