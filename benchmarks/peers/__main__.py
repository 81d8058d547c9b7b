"""Encore and other libraries before the same simulated listeners.

    python -m benchmarks.peers [--runs 200] [--worlds static satiation arbitrary]

A listener has a true hidden state for each of 15 items, and answers by it. Encore knows
the parameters, or something wrong; the peers learn from the answers, or begin with a
log of random plays of other listeners. Prints a table for each world, in Markdown.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy reads it

import argparse

from benchmarks.machine import describe
from benchmarks.peers import counting, encore, vowpal
from benchmarks.peers.contest import contest
from benchmarks.peers.listeners import check
from benchmarks.peers.table import losses, table
from benchmarks.peers.worlds import WORLDS, Seed
from policies import POLICIES, ModelSet

LIBRARIES = ("numpy", "numba", "river", "mabwiser", "vowpalwabbit", "coba")


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200, help="listeners in each world")
    parser.add_argument("--slots", type=int, default=200)
    parser.add_argument("--catalogues", type=int, default=10, help="share the runs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--worlds", nargs="+", choices=WORLDS, default=list(WORLDS))
    parser.add_argument(
        "--policies", nargs="+", choices=POLICIES, default=encore.DEFAULT
    )
    chosen = parser.parse_args()
    if chosen.runs % chosen.catalogues or chosen.runs < 2 * chosen.catalogues:
        parser.error("--runs: needs the same number for each catalogue, at least 2")
    return chosen


def show(world: str, chosen: argparse.Namespace) -> None:
    kind = WORLDS[world]
    seed = Seed([chosen.seed, kind.number])
    for_catalogues, for_mistakes, for_runs = seed.spawn(3)
    catalogues = [
        kind.catalogue(part) for part in for_catalogues.spawn(chosen.catalogues)
    ]
    truth = [ModelSet.of(models) for models in catalogues]
    check(truth[0], chosen.slots)
    mistakes = for_mistakes.spawn(chosen.catalogues)
    competitors = [
        *encore.competitors(chosen.policies, catalogues, mistakes),
        *counting.competitors(),
        *vowpal.competitors(),
    ]
    listeners = chosen.runs // chosen.catalogues
    results = contest(competitors, truth, listeners, chosen.slots, for_runs)
    print(f"\n### `{world}`: {kind.says}\n\n{table(competitors, results)}\n")
    lost = list(losses(competitors, results))
    print("Encore loses:\n" if lost else "Encore loses nowhere.")
    print("\n".join(lost), flush=True)


def main() -> None:
    chosen = options()
    print(describe(LIBRARIES))
    print(
        f"{chosen.runs} listeners in {chosen.catalogues} catalogues of 15 items,"
        f" {chosen.slots} slots, seed {chosen.seed}",
        flush=True,
    )
    for world in chosen.worlds:
        show(world, chosen)


if __name__ == "__main__":
    main()
