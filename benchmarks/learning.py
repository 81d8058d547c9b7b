"""How fast chains are learned, and beside hmmlearn, where both can.

Run as `python -m benchmarks.learning`. The first log has a million plays of ten arms a
user, who rest while others are played. The second has one arm a user, so that nothing
rests: that hmmlearn can learn, too. Both are given the same chain to begin with and the
same number of plain steps of EM, without extrapolation.
"""

import argparse
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial, reduce
from operator import add

import numpy as np
from distributed import LocalCluster

from benchmarks.machine import describe
from benchmarks.random_log import sampled
from learning import Plays
from learning.chain import Chain
from learning.cluster import cluster
from learning.em import Spread
from learning.expectation import expect
from learning.maximization import Smoothing, drawn, maximize
from learning.streams import Streams, streams
from simulation import example

STATES, STEPS, SLOTS = 4, 50, 200
NOTHING = Smoothing(1e-9, 1e-9, 1e-9)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plays", type=int, default=1_000_000)
    users = parser.parse_args().plays // SLOTS
    print(
        f"{describe()}\n{STEPS} steps of EM, {STATES} states, {users * SLOTS} plays\n"
    )
    print("| log | learned by | threads | time | log likelihood |")
    print("| --- | --- | --- | --- | --- |")
    rng = np.random.default_rng(1)
    models = example(1).models
    begun = drawn(STATES, 0.5, rng)
    for label, arms in (("ten arms, that rest", 10), ("one arm, no rest", 1)):
        plays = sampled(
            [models[arm % len(models)] for arm in range(arms)], users, SLOTS, 2
        )
        seen = streams(plays)
        steps(seen.parts()[:1], begun, 1, map)  # compiles
        for threads in (1, os.cpu_count() or 1):
            with ThreadPoolExecutor(threads) as pool:
                work = partial(steps, seen.parts(), begun, STEPS, pool.map)
                _tell(label, "Encore", threads, work)
        _tell_of_a_cluster(label, seen.parts(), begun)
        if arms == 1:
            _tell(label, "hmmlearn", 1, partial(by_hmmlearn, plays, begun))


def _tell(label: str, by: str, threads: int, work: Callable[[], float]) -> None:
    began = time.perf_counter()
    likelihood = work()
    took = time.perf_counter() - began
    print(
        f"| {label} | {by} | {threads} | {took:.1f} s | {likelihood:.1f} |", flush=True
    )


def _tell_of_a_cluster(label: str, parts: Sequence[Streams], begun: Chain) -> None:
    """Tell of as many processes; once they hold the log and have compiled code."""
    workers = os.cpu_count() or 1
    with (
        LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=":0"
        ) as machines,
        cluster(machines.scheduler_address) as spread,
    ):
        steps(parts, begun, 1, spread)
        work = partial(steps, parts, begun, STEPS, spread)
        _tell(label, "Encore on Dask", workers, work)


def steps(parts: Sequence[Streams], chain: Chain, count: int, spread: Spread) -> float:
    """Take plain steps of EM; return the ln likelihood before the last one."""
    likelihood = -np.inf
    for _ in range(count):
        found = reduce(add, spread(partial(expect, chain=chain), parts))
        likelihood = found.likelihood
        chain = maximize(found, chain, NOTHING)
    return likelihood


def by_hmmlearn(plays: Plays, chain: Chain) -> float:
    """Do the same with hmmlearn's categorical model, which is written in C++."""
    from hmmlearn.hmm import CategoricalHMM  # noqa: PLC0415 - `pip install hmmlearn`

    model = CategoricalHMM(
        STATES, n_iter=STEPS, tol=-np.inf, init_params="", n_features=2
    )
    model.startprob_, model.transmat_ = chain.prior, chain.play
    model.emissionprob_ = chain.observe[0]
    lengths = np.diff(plays.first)
    model.fit(plays.answer.astype(np.int64)[:, None], lengths)
    return float(model.monitor_.history[-1])


if __name__ == "__main__":
    main()
