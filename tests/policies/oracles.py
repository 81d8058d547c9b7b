"""Slow and obvious versions of what `policies` computes, written from definitions.

They share the random numbers with `policies`, and nothing else.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, inf, log2, nextafter
from typing import TypeAlias

import numpy as np

from policies import LIKED, NONE, Floats, Model, Mood
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
    mood: int = 0


def emission(model: Model, state: int, slot: Slot) -> float:
    """Return the chance of the signal in a hidden state."""
    if not slot.played or slot.signal == NONE:
        return 1.0
    return float(model.observe_in[slot.mood, state, slot.signal])


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


@dataclass(frozen=True)
class Feeling:
    """What a mood follows from: all answers so far, 1 a like, the last one last.

    resumed: whether the next play comes after a pause
    """

    answers: tuple[int, ...] = ()
    resumed: bool = False

    def of(self, mood: Mood) -> int:
        """Number the moods: by the last answers, the tendency, and the pause."""
        last = self.answers[len(self.answers) - min(mood.answers, len(self.answers)) :]
        strings: list[tuple[int, ...]] = []
        for length in range(mood.answers + 1):
            strings.extend(product((0, 1), repeat=length))
        level = sum(self.tendency(mood) >= level for level in mood.levels)
        number = strings.index(last) * (len(mood.levels) + 1) + level
        return number if mood.pause_s is None else 2 * number + self.resumed

    def tendency(self, mood: Mood) -> float:
        tendency = 0.5
        for n, answer in enumerate(self.answers):
            step = 1 / (n + 2)
            if mood.memory is not None:
                step = max(step, 1 / mood.memory)
            tendency += step * (answer - tendency)
        return tendency

    def after(self, answer: int) -> "Feeling":
        return Feeling((*self.answers, answer))

    def observe(self, model: Model) -> Floats:
        """Return the chances of a model's signals, by state, in this mood."""
        number = 0 if model.mood is None else self.of(model.mood)
        chances: Floats = model.observe_in[number]
        return chances


CALM = Feeling()


@dataclass(frozen=True)
class Item:
    """One item with a belief of its own.

    kind:    what a base ranks as one: equal groups; chosen items come before all
    rested:  slots since its last play
    touched: number of its first imagined play, 0 before it
    gone:    played in the present slot; the belief is that of the next one already
    """

    kind: int
    row: int
    model: Model
    belief: Floats
    rested: int
    touched: int = 0
    gone: bool = False

    @property
    def chance(self) -> float:
        """In the mean mood."""
        return float(self.belief @ self.model.like)

    def chances(self, feeling: Feeling) -> Floats:
        """Of the signals."""
        return self.belief @ feeling.observe(self.model)

    def reward(self, feeling: Feeling) -> float:
        return float(self.chances(feeling) @ self.model.reward)

    def lift(self, feeling: Feeling) -> float:
        return self.reward(feeling) - self.chance if self.model.mood else 0.0

    def answered(self, signal: int, turn: int, feeling: Feeling) -> "Item":
        told = normalised(self.belief * feeling.observe(self.model)[:, signal])
        return replace(
            self,
            belief=told @ self.model.play,
            rested=0,
            touched=self.touched or turn,
            gone=True,
        )

    @property
    def in_the_next_slot(self) -> "Item":
        if self.gone:
            return replace(self, gone=False)
        belief = self.belief @ self.model.rest
        return replace(self, belief=belief, rested=self.rested + 1)


Rule: TypeAlias = Callable[[Item, Feeling], float]


@dataclass(frozen=True)
class World:
    """All items at one moment of a slot, which ends after `plays` plays."""

    items: tuple[Item, ...]
    plays: int
    slot: int = 0
    turn: int = 1
    feeling: Feeling = CALM

    @property
    def free(self) -> list[int]:
        """Numbers of the items that this slot has not played."""
        return [number for number, item in enumerate(self.items) if not item.gone]

    def after(self, number: int, signal: int) -> "World":
        items = list(self.items)
        items[number] = items[number].answered(signal, self.turn, self.feeling)
        liked = int(items[number].model.reward[signal] >= LIKED)
        feeling = self.feeling.after(liked)
        if sum(item.gone for item in items) < self.plays:
            return World(tuple(items), self.plays, self.slot, self.turn + 1, feeling)
        moved = tuple(item.in_the_next_slot for item in items)
        return World(moved, self.plays, self.slot + 1, self.turn + 1, feeling)

    def reward(self, number: int) -> float:
        return self.items[number].reward(self.feeling)

    def chances(self, number: int) -> Floats:
        """Of the signals of an item."""
        return self.items[number].chances(self.feeling)

    def best(self, rule: Rule) -> int:
        """Pick by a rule; ties: lowest kind, then untouched, then touched first."""
        keys = {
            number: (-rule(item, self.feeling), item.kind, item.touched)
            for number, item in enumerate(self.items)
            if not item.gone
        }
        return min(keys, key=keys.__getitem__)


def world_of(instance: Instance, *, by_rest: bool = False) -> World:
    """List all items, group by group, then those that are chosen."""
    items = [
        Item(
            kind,
            instance.rows[group],
            instance.model(group),
            instance.beliefs[group],
            instance.since[group],
        )
        for group, kind in enumerate(kinds(instance, by_rest=by_rest))
        for _ in range(instance.counts[group])
    ]
    for row, belief in instance.chosen:
        model = instance.models[row]
        items.append(Item(-1, row, model, belief @ model.play, 0, gone=True))
    feeling = Feeling(instance.answers, instance.resumed)
    return World(tuple(items), min(instance.plays, len(items)), feeling=feeling)


def kinds(instance: Instance, *, by_rest: bool) -> list[int]:
    """Number the groups; equal ones have one number."""
    rested = instance.since if by_rest else (0,) * len(instance.rows)
    keys = [
        (row, tuple(belief), slots)
        for row, belief, slots in zip(
            instance.rows, instance.beliefs, rested, strict=True
        )
    ]
    return [list(dict.fromkeys(keys)).index(key) for key in keys]


def first_items(instance: Instance) -> list[int]:
    """Return the number of each group's first item."""
    return [sum(instance.counts[:group]) for group in range(len(instance.counts))]


def ever(item: Item, discount: float) -> float:
    """Return the discounted rewards of playing an item for ever."""
    kept = np.eye(len(item.belief)) - discount * item.model.play
    return float(item.belief @ np.linalg.solve(kept, item.model.like))


def plain_rule(base: str, discount: float) -> Rule:
    """Return the score by which a base plays that needs no tables."""
    return {
        "myopic": lambda item, feeling: item.chance + item.lift(feeling),
        "best_fixed": lambda item, _feeling: ever(item, discount),
        "round_robin": lambda item, _feeling: float(item.rested),
    }[base]


@dataclass(frozen=True)
class Plan:
    """An exact rollout; a base without a rule plays at random.

    leaf: what is earned after the last play, by a base's rule, from that slot on
    """

    rules: Sequence[Rule | None]
    horizon: int
    discount: float
    depth: int = 1
    leaf: Callable[[World, Rule | None], float] = lambda _world, _rule: 0.0


def exact_scores(
    plan: Plan, instance: Instance, *, by_rest: bool = False
) -> list[float]:
    """Score every group by all answers to all plays, item by item."""
    world = world_of(instance, by_rest=by_rest)
    return [tried(plan, world, first, 1) for first in first_items(instance)]


def tried(plan: Plan, world: World, number: int, depth: int) -> float:
    """Return the worth of playing an item, and of the best there is after it."""

    def future(after: World) -> float:
        if depth < plan.depth:
            return max(tried(plan, after, n, depth + 1) for n in after.free)
        return max(based(plan, after, rule, plan.horizon) for rule in plan.rules)

    return played(plan, world, number, future)


def based(plan: Plan, world: World, rule: Rule | None, plays: int) -> float:
    """Return the worth of some plays of a base, and of the leaf."""
    if plays == 0:
        return plan.discount**world.slot * plan.leaf(world, rule)
    choices = world.free if rule is None else [world.best(rule)]
    worths = [
        played(plan, world, number, lambda after: based(plan, after, rule, plays - 1))
        for number in choices
    ]
    return sum(worths) / len(worths)


def played(
    plan: Plan, world: World, number: int, future: Callable[[World], float]
) -> float:
    """Return the reward of a play, and the mean future over its answers."""
    return plan.discount**world.slot * world.reward(number) + sum(
        float(chance) * future(world.after(number, signal))
        for signal, chance in enumerate(world.chances(number))
        if chance > 0
    )


@dataclass(frozen=True)
class Trials:
    """A Monte Carlo rollout, trajectory by trajectory; no rule: a random base."""

    policy: Rollout
    instance: Instance
    seed: int
    rule: Rule | None

    @property
    def world(self) -> World:
        return world_of(self.instance, by_rest=self.policy.base == "round_robin")

    @property
    def candidates(self) -> list[int]:
        """Number the first actions of all groups; equal ones have one number."""
        if self.policy.base == "random":
            return list(range(len(self.instance.rows)))
        return kinds(self.instance, by_rest=self.policy.base == "round_robin")

    def score(self, candidate: int, trajectories: int) -> float:
        world = self.world
        first = first_items(self.instance)[self.candidates.index(candidate)]
        futures = [self.future(world, first, t, candidate) for t in range(trajectories)]
        return world.reward(first) + sum(futures) / trajectories

    def future(self, world: World, first: int, t: int, candidate: int) -> float:
        """Return the rewards that count beside the first one, in either reading."""
        policy, total = self.policy, 0.0
        start = 64 * (0 if policy.common_random_numbers else candidate)
        for h in range(policy.horizon + (policy.reading == "tail")):
            number = first
            if h > 0 and self.rule is None:
                drawn = uniform(self.seed, ITEMS, t, start + h)
                number = world.free[int(drawn * len(world.free))]
            elif h > 0 and self.rule is not None:
                number = world.best(self.rule)
            draw = uniform(self.seed, ANSWERS, t, start + h)
            signal = drawn_signal(world.chances(number), draw)
            worth = policy.discount**world.slot
            if policy.reward == "expected":
                worth *= world.reward(number)
            else:
                worth *= float(world.items[number].model.reward[signal])
            if policy.reading == "literal":
                total += policy.discount * worth
            elif h > 0:
                total += worth
            world = world.after(number, signal)
        return total


def drawn_signal(chances: Floats, draw: float) -> int:
    """Draw a signal: the lowest numbers give the last one."""
    for signal in range(len(chances) - 1, 0, -1):
        if draw < chances[signal:].sum():
            return signal
    return 0


def naive_rollout(trials: Trials) -> list[float]:
    """Score every group by as many trajectories."""
    return [
        trials.score(candidate, trials.policy.trajectories)
        for candidate in trials.candidates
    ]


def naive_halving(trials: Trials) -> tuple[list[float], int]:
    """Score every group by sequential halving; return the trajectories it took, too."""
    staying = list(dict.fromkeys(trials.candidates))
    total, out, scores = len(staying), list[int](), dict[int, float]()
    each = used = 0
    rounds = max(ceil(log2(total)), 1)
    for _ in range(rounds):
        more = max(trials.policy.trajectories * total // (len(staying) * rounds), 1)
        each, used = each + more, used + more * len(staying)
        scores |= {candidate: trials.score(candidate, each) for candidate in staying}
        staying.sort(key=lambda candidate: -scores[candidate])
        half = (len(staying) + 1) // 2
        staying, out = staying[:half], staying[half:] + out
    least = inf
    for candidate in staying + out:
        scores[candidate] = least = min(scores[candidate], nextafter(least, -inf))
    return [scores[candidate] for candidate in trials.candidates], used
