"""How well models are found again in what they gave rise to.

Run as `python -m benchmarks.recovery`. For each seed, users are played the items of the
paper's example 1 at random; a chain is learned for each item alone; then both are put
to the same users anew: what the learned models foretell of their answers, and what a
policy earns that plans with them, against the same with the true models.
"""

import argparse
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from benchmarks.machine import describe
from benchmarks.random_log import sampled
from learning.chain import Chain
from learning.em import Effort, Terms, beginnings, learn
from learning.expectation import likelihoods
from learning.maximization import Smoothing
from learning.streams import streams
from policies import Model, ModelSet, create
from simulation import (
    Course,
    Listeners,
    contenders,
    example,
    half_width,
    opening,
    value,
)
from simulation.examples import DISCOUNT, STATES

USERS, SLOTS, RUNS = 2000, 200, 4000
POLICY = "whittle"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--policy", default=POLICY)
    given = parser.parse_args()
    true = example(1).models
    print(f"{describe()}\n{USERS} users, {SLOTS} plays each, policy {given.policy}\n")
    print(
        "| seed | log loss, true | learned | ratio | reward, true | learned | ratio |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    found = np.array([_one(true, given.policy, seed) for seed in range(given.seeds)])
    loss, reward = found[:, 1] / found[:, 0], found[:, 3] / found[:, 2]
    for what, ratio in (("log loss", loss), ("reward", reward)):
        half = half_width(ratio) if len(ratio) > 1 else np.nan
        print(
            f"{what}: ratio {ratio.mean():.5f} ± {half:.5f}, worst"
            f" {ratio.max() if what == 'log loss' else ratio.min():.5f}"
        )


def _one(true: Sequence[Model], policy: str, seed: int) -> tuple[float, ...]:
    learned = _learned(true, seed)
    losses = [_log_loss(models, true, seed + 10_000) for models in (true, learned)]
    rewards = [_reward(models, true, policy, seed) for models in (true, learned)]
    print(
        f"| {seed} | {losses[0]:.5f} | {losses[1]:.5f} | {losses[1] / losses[0]:.5f}"
        f" | {rewards[0]:.3f} | {rewards[1]:.3f} | {rewards[1] / rewards[0]:.4f} |",
        flush=True,
    )
    return (*losses, *rewards)


def _learned(true: Sequence[Model], seed: int) -> Sequence[Model]:
    """Learn a model of each item from a random log."""
    plays = sampled(true, USERS, SLOTS, seed)
    seen, effort = streams(plays), Effort(starts=4, steps=200, seed=seed)
    found = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for arm in range(len(true)):
            own = seen.of(seen.arm == arm)
            begun = beginnings(len(STATES), 0.5, effort)
            terms = Terms(Smoothing())
            reward = np.array(plays.reward)
            chain = learn(own, begun, reward, effort, terms, pool.map).chain
            like = chain.observe[0, :, 1]
            found.append(Model(STATES, chain.play, chain.rest, like, chain.prior))
    return found


def _log_loss(models: Sequence[Model], true: Sequence[Model], seed: int) -> float:
    """Return what models lose on the answers of other users, in nats a play."""
    plays = sampled(true, USERS, SLOTS, seed)
    seen = streams(plays)
    total = 0.0
    for arm, model in enumerate(models):
        chain = Chain(model.play, model.rest, model.observe[None], model.prior)
        total -= float(likelihoods(seen.of(seen.arm == arm), chain).sum())
    return total / len(plays)


def _reward(
    models: Sequence[Model], true: Sequence[Model], policy: str, seed: int
) -> float:
    """Return what a policy earns that plans with some models, where others are true."""
    start = opening(models)
    truth = ModelSet.of(true)
    listeners = replace(Listeners.believed(start), models=truth, belief=truth.prior)
    course = Course(RUNS, SLOTS, DISCOUNT, seed)
    ready = contenders([create(policy, {})], start.models)
    [found] = value(ready, start, course, listeners)
    return float(found.mean)


if __name__ == "__main__":
    main()
