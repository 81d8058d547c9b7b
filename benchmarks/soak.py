"""Whether a service stays as it is: memory, latency and errors over a long time.

    python -m benchmarks.soak [--seconds 3600] [--load 0.5] [--databases postgresql]

One server on the first core, with the default policy and its index tables; PostgreSQL
and the load on the other, at a share of the rate that the server keeps up with. The
load is that of `encore bench`: it checks every answer, and all histories at the end.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from benchmarks.machine import describe
from benchmarks.population import HERE, Population
from benchmarks.throughput.servers import (
    ENCORE,
    KEY,
    LOAD_CORE,
    Running,
    databases,
    served,
)

DATABASES = ("sqlite", "postgresql")
POPULATION = Population(users=10_000, played=50, items=100)
ROWS = 12
PAUSE = 5.0  # seconds
IDLE = 0.05  # of a core


class Seen(NamedTuple):
    """The server after some seconds of load."""

    seconds: float
    megabytes: float
    cpu: float


def main() -> None:
    options = _options()
    print(describe())
    for kind in options.databases:
        print(f"\n{kind}\n")
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            (url,) = databases(kind, folder, stack, "encore")
            POPULATION.fill(url, folder)
            server = stack.enter_context(served("encore", ENCORE, url, "auto"))
            _settle(server)
            _soak(server, options)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3600)
    parser.add_argument("--load", type=float, default=0.5, help="of the maximum rate")
    parser.add_argument("--databases", nargs="+", choices=DATABASES, default=DATABASES)
    return parser.parse_args()


def _settle(server: Running) -> None:
    """Wait until nothing is compiled or built any more."""
    spent, now = -math.inf, server.cpu()
    while now - spent > IDLE * PAUSE:
        time.sleep(PAUSE)
        spent, now = now, server.cpu()


def _soak(server: Running, options: argparse.Namespace) -> None:
    with tempfile.TemporaryFile() as told_to:
        load = subprocess.Popen(
            [
                *("taskset", "--cpu-list", str(LOAD_CORE)),
                *(sys.executable, "-m", "app.cli", "bench", "--json", "--key", KEY),
                *("--url", f"http://127.0.0.1:{server.port}"),
                *("--prefix", "user-", "--users", str(POPULATION.users)),
                *("--load", str(options.load), "--duration", str(options.seconds)),
            ],
            cwd=HERE,
            stdout=told_to,
            stderr=subprocess.DEVNULL,
        )
        seen = list(_watch(server, load, options.seconds / ROWS))
        told_to.seek(0)
        told = json.load(told_to)
    print("| minutes | memory | share of a core |")
    print("| --- | --- | --- |")
    for before, now in pairwise(seen):
        share = (now.cpu - before.cpu) / (now.seconds - before.seconds)
        print(f"| {now.seconds / 60:.0f} | {now.megabytes:.0f} MB | {share:.2f} |")
    rate, checks = told["rate"], told["checks"]
    print(f"\nmaximum {told['maximum']} a second, asked {rate['wanted']:.0f}")
    print(f"answered {told['answered']}, failed {told['failed']}: {told['failures']}")
    print(f"checked {checks['answers']} answers, {checks['histories']} histories:")
    print(f"faults {checks['faults']}, open {checks['open']}")
    for step, times in told["latency_ms"].items():
        print(step, {name: round(value, 2) for name, value in times.items()})
    if load.returncode:
        raise SystemExit(load.returncode)


def _watch(
    server: Running, load: "subprocess.Popen[bytes]", every: float
) -> Iterator[Seen]:
    began = time.monotonic()
    while True:
        passed = time.monotonic() - began
        yield Seen(passed, server.megabytes("VmRSS"), server.cpu())
        try:
            load.wait(every)
        except subprocess.TimeoutExpired:
            continue
        return


if __name__ == "__main__":
    main()
