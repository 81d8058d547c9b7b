"""Slow and obvious versions of what `policies` computes, written from MODEL.md.

They share the random numbers with `policies`, and nothing else.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from policies import NONE, Floats, Model
from policies.randomness import ANSWERS, ITEMS, uniform
from policies.rollout import Rollout
from tests.policies.instances import Instance


def normalised(weights: Floats) -> Floats:
    shares: Floats = weights / weights.sum()
    return shares


@dataclass(frozen=True)
class Slot:
    """What happens to one item in one slot: rest, or a play with its signal."""

    played: bool
    signal: int


def emission(model: Model, state: int, slot: Slot) -> float:
    """Return the chance of the signal in a hidden state."""
    if not slot.played or slot.signal == NONE:
        return 1.0
    return float(model.observe[state, slot.signal])


def enumerated_belief(model: Model, slots: Sequence[Slot]) -> Floats:
    """Return the belief after `slots`, by the sum over all hidden paths."""
    weights = np.zeros(len(model.states))
    for path in product(range(len(model.states)), repeat=len(slots) + 1):
        weight = float(model.prior[path[0]])
        for t, slot in enumerate(slots):
            moves = model.play if slot.played else model.rest
            weight *= emission(model, path[t], slot) * moves[path[t], path[t + 1]]
        weights[path[-1]] += weight
    return normalised(weights)


@dataclass
class Item:
    """One item with a belief of its own."""

    group: int
    model: Model
    belief: Floats
    touched: int = 0

    @property
    def chance(self) -> float:
        return float(sum(self.belief * self.model.like))

    def after(self, *, played: bool, liked: bool, turn: int) -> "Item":
        if not played:
            rested = self.belief @ self.model.rest
            return Item(self.group, self.model, rested, self.touched)
        signal = self.model.like if liked else 1 - self.model.like
        weights = self.belief * signal
        moved = normalised(weights) @ self.model.play
        return Item(self.group, self.model, moved, self.touched or turn)


def items_of(instance: Instance) -> list[Item]:
    """List all items, group by group."""
    return [
        Item(group, instance.model(group), instance.beliefs[group])
        for group, count in enumerate(instance.counts)
        for _ in range(count)
    ]


def advance(
    items: Sequence[Item], played: int, turn: int, *, liked: bool
) -> list[Item]:
    """Move every item on by one slot."""
    return [
        item.after(played=number == played, liked=liked, turn=turn)
        for number, item in enumerate(items)
    ]


def myopic(items: Sequence[Item]) -> int:
    """Pick the best item; ties: lowest group, then untouched, then touched first."""
    keys = [(-item.chance, item.group, item.touched) for item in items]
    return min(range(len(items)), key=keys.__getitem__)


def first_items(instance: Instance) -> list[int]:
    """Return the number of each group's first item."""
    return [sum(instance.counts[:group]) for group in range(len(instance.counts))]


def naive_rollout(policy: Rollout, instance: Instance, seed: int) -> list[float]:
    """Score every group by simulating trajectories one by one, item by item."""
    scores = []
    for group, first in enumerate(first_items(instance)):
        candidate = 0
        if not policy.common_random_numbers:
            candidate = group if policy.base == "random" else number(instance, group)
        own = items_of(instance)[first].chance
        futures = [
            naive_trajectory(policy, items_of(instance), first, (seed, t, candidate))
            for t in range(policy.trajectories)
        ]
        mean = sum(futures) / policy.trajectories
        scores.append(own + policy.discount * mean)
    return scores


def number(instance: Instance, group: int) -> int:
    """Return how many different groups lie before the first one like this one."""
    kinds = [
        (row, tuple(belief))
        for row, belief in zip(instance.rows, instance.beliefs, strict=True)
    ]
    return list(dict.fromkeys(kinds)).index(kinds[group])


def naive_trajectory(
    policy: Rollout, items: list[Item], first: int, key: tuple[int, int, int]
) -> float:
    """Return sum_h beta^(h-1) R_h of one trajectory, in either reading."""
    rewards = []
    plays = policy.horizon + 1 if policy.reading == "tail" else policy.horizon
    seed, t, candidate = key
    for h in range(plays):
        at = candidate * 64 + h
        played = first
        if h > 0 and policy.base == "myopic":
            played = myopic(items)
        if h > 0 and policy.base == "random":
            played = int(uniform(seed, ITEMS, t, at) * len(items))
        chance = items[played].chance
        liked = uniform(seed, ANSWERS, t, at) < chance
        rewards.append(chance if policy.reward == "expected" else float(liked))
        items = advance(items, played, h + 1, liked=liked)
    if policy.reading == "tail":
        rewards = rewards[1:]
    return sum(policy.discount**h * reward for h, reward in enumerate(rewards))


def base_value(
    items: Sequence[Item], plays: int, discount: float, base: str = "myopic"
) -> float:
    """Return the exact expected discounted likes of `plays` plays of a base policy."""
    if plays == 0:
        return 0.0
    choices = [myopic(items)] if base == "myopic" else range(len(items))
    values = [value_of(items, played, plays, discount, base) for played in choices]
    return sum(values) / len(values)


def value_of(
    items: Sequence[Item], first: int, plays: int, discount: float, base: str = "myopic"
) -> float:
    """Return the exact value of playing `first`, then by the base, `plays` in all."""
    chance = items[first].chance
    futures = 0.0
    for liked, weight in ((True, chance), (False, 1 - chance)):
        if weight > 0:
            after = advance(items, first, 100 - plays, liked=liked)
            futures += weight * base_value(after, plays - 1, discount, base)
    return chance + discount * futures


def exact_rollout(
    instance: Instance, horizon: int, discount: float, base: str = "myopic"
) -> list[float]:
    """Return what the scores of a rollout estimate, in the reading "tail"."""
    items = items_of(instance)
    return [
        value_of(items, first, horizon + 1, discount, base)
        for first in first_items(instance)
    ]
