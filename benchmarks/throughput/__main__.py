"""Pairs of next and feedback over HTTP: Encore against the yardstick, in one run.

    python -m benchmarks.throughput [--databases sqlite postgresql] [--rounds 9]

The server has one core; the load, and PostgreSQL, the other. Every server runs once in
each round, while the others are stopped, and what is compared is the median of the
ratios within a round: machines drift. Then each is asked at 70 % of its own maximum,
by the clock.

The yardstick goes through the web framework, past which Encore's plain requests pass
(docs/adr/0021). So Encore runs a second time without that: it is the ratio that says
what Encore's own work costs, on the same stack.
"""

import argparse
import os
import statistics
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field

from app.load.crew import Crew
from app.load.drive import Pace
from app.load.plan import Plan, Target
from app.load.tally import Step, Tally
from benchmarks.machine import describe
from benchmarks.population import Population
from benchmarks.throughput.servers import KEY, LOAD_CORE, Running, contestants

AIMS = {"sqlite": 0.8, "postgresql": 0.9}
STEEPEST = 5  # times the median: the 99th percentile at most
SHARE = 0.7
ASKED = (Step.NEXT, Step.FEEDBACK)


@dataclass
class Rival:
    """A server, who asks it, and what came of that."""

    server: Running
    crew: Crew
    rates: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)

    def round(self, seconds: float) -> None:
        """Ask as fast as it answers."""
        before = self.server.cpu()
        tally = self.drive(Pace(None, seconds))
        used = self.server.cpu() - before
        self.rates.append(tally.rate)
        self.cpu.append(used / tally.answered * 1e6)
        print(
            f"{self.server.name:24} {self.rates[-1]:6.0f} req/s"
            f" {self.cpu[-1]:6.0f} us CPU each  {latencies(tally)}",
            flush=True,
        )

    def drive(self, pace: Pace) -> Tally:
        self.server.go_on()
        tally = self.crew.drive(pace, lambda *_: None)
        self.server.pause()
        if tally.faults or tally.failures:
            raise RuntimeError(f"{self.server.name}: {tally.shown}, {tally.failures}")
        return tally


def latencies(tally: Tally) -> str:
    told = []
    for step in ASKED:
        times = tally.latency[step]
        told.append(f"{step} p50 {times.at(50):6.2f} p99 {times.at(99):6.2f} ms")
    return "  ".join(told)


def compare(kind: str, options: argparse.Namespace) -> None:
    population = Population(options.users, options.played, options.items)
    with ExitStack() as stack:
        servers = stack.enter_context(contestants(kind, population))
        rivals = [
            Rival(server, stack.enter_context(Crew(plan(server, options), 1)))
            for server in servers
        ]
        for rival in rivals:
            rival.drive(Pace(None, 2))  # caches fill
        for number in range(options.rounds):
            for rival in rivals if number % 2 else reversed(rivals):
                rival.round(options.seconds)
        hand, *ours = rivals
        for one in ours:
            report(kind, hand, one)
        for even in (True, False):
            for rival in rivals:
                steady(rival, options.steady, even=even)


def report(kind: str, hand: Rival, ours: Rival) -> None:
    rates = ratios(ours.rates, hand.rates)
    cpu = ratios(hand.cpu, ours.cpu)
    print(
        f"{ours.server.name} / {hand.server.name}: {statistics.median(rates):.2f}"
        f" (aim {AIMS[kind]}), rounds {' '.join(f'{ratio:.2f}' for ratio in rates)};"
        f" by processor time {statistics.median(cpu):.2f}"
        f" ({statistics.median(hand.cpu):.0f}, {statistics.median(ours.cpu):.0f} us)",
        flush=True,
    )


def ratios(one: Sequence[float], other: Sequence[float]) -> list[float]:
    return [a / b for a, b in zip(one, other, strict=True)]


def steady(rival: Rival, seconds: float, *, even: bool) -> None:
    """Ask by the clock at a share of the maximum."""
    rate = SHARE * statistics.median(rival.rates)
    tally = rival.drive(Pace(rate, seconds, even))
    steepest = max(
        tally.latency[step].at(99) / tally.latency[step].at(50) for step in ASKED
    )
    print(
        f"{rival.server.name:24} {rate:6.0f} req/s {'even' if even else 'random'}"
        f"  {latencies(tally)}  p99/p50 {steepest:.1f} (aim {STEEPEST}),"
        f" sent late p99 {tally.late.at(99):.2f} ms",
        flush=True,
    )


def plan(server: Running, options: argparse.Namespace) -> Plan:
    users = [f"user-{number}" for number in range(options.users)]
    target = Target.of(f"http://127.0.0.1:{server.port}")
    return Plan(target, KEY, users, options.connections, fresh=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--databases", nargs="+", choices=AIMS, default=[*AIMS])
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--steady", type=float, default=15)
    parser.add_argument("--connections", type=int, default=16)
    parser.add_argument("--users", type=int, default=10_000)
    parser.add_argument("--played", type=int, default=50)
    parser.add_argument("--items", type=int, default=100)
    options = parser.parse_args()
    os.sched_setaffinity(0, {LOAD_CORE})
    print(describe())
    for kind in options.databases:
        compare(kind, options)


if __name__ == "__main__":
    main()
