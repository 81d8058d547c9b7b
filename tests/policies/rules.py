"""By what bases play and leaves are valued, item by item, for the oracles.

Where that is kept in tables, it is looked up in them: so what is tested with it is all
but the tables.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from policies import Floats, Ints, ModelSet, Tables, index
from policies.base import LOOKED_UP
from policies.index import Index
from policies.relaxation import (
    Relaxation,
    least,
    priced_advantage,
    priced_value,
    relaxed,
)
from tests.policies.instances import Instance, padded
from tests.policies.oracles import (
    Item,
    Plan,
    Rule,
    World,
    ever,
    first_items,
    plain_rule,
    world_of,
)


def memoised(rule: Callable[[Item], float]) -> Callable[[Item], float]:
    """Look up only once what many futures share."""
    known: dict[tuple[int, bytes], float] = {}

    def value(item: Item) -> float:
        key = (item.row, item.belief.tobytes())
        if key not in known:
            known[key] = rule(item)
        return known[key]

    return value


@dataclass(frozen=True)
class Rules:
    """The rules of an instance, at one discount."""

    instance: Instance
    tables: Tables
    discount: float

    @cached_property
    def models(self) -> ModelSet:
        return ModelSet.of(self.instance.models)

    @property
    def firsts(self) -> list[Item]:
        """The first item of each group."""
        items = world_of(self.instance).items
        return [items[first] for first in first_items(self.instance)]

    @cached_property
    def relaxation(self) -> Relaxation:
        return relaxed(self.models, self.tables)

    @cached_property
    def price(self) -> float:
        """The price at which the bound is least, chosen items included."""
        instance, ones = self.instance, [1] * len(self.instance.chosen)
        rows = [*instance.rows, *(row for row, _ in instance.chosen)]
        beliefs = [*instance.beliefs, *(belief for _, belief in instance.chosen)]
        return least(
            self.relaxation,
            np.array(rows, dtype=np.int64),
            padded(beliefs, self.models.like.shape[1]),
            np.array([*instance.counts, *ones], dtype=np.int64),
            instance.plays,
        ).price

    def rule(self, base: str) -> Rule:
        if base not in LOOKED_UP:
            return plain_rule(base, self.discount)
        if base == "whittle" and self.tables.indexable:
            whittle = index.tabled(self.tables.whittle, self.models.like.shape[1])
            return self._by_mood(self._looked_up(whittle))
        return self._by_mood(
            self._looked_up(priced_advantage(self.relaxation, self.price))
        )

    def plan(self, bases: Sequence[str], horizon: int, depth: int, leaf: str) -> Plan:
        """Return the exact rollout of these names."""
        known = {"none": self._nothing, "base": self._for_ever}
        if leaf == "lagrangian":
            items = sum(self.instance.counts) + len(self.instance.chosen)
            plays = min(self.instance.plays, items)
            horizon += -(len(self.instance.chosen) + depth + horizon) % plays
        rules = [self.rule(base) for base in bases]
        worth = known.get(leaf, self._bound)
        return Plan(rules, horizon, self.discount, depth, worth)

    def _nothing(self, _world: World, _rule: Rule | None) -> float:
        return 0.0

    def _for_ever(self, world: World, rule: Rule | None) -> float:
        assert rule is not None
        return ever(world.items[world.best(rule)], self.discount)

    def _bound(self, world: World, _rule: Rule | None) -> float:
        value = self._looked_up(priced_value(self.relaxation, self.price))
        resting = len(world.items) - world.plays
        paid = self.price * resting / (1 - self.discount)
        return sum(value(item) for item in world.items) - paid

    def _by_mood(self, value: Callable[[Item], float]) -> Rule:
        return lambda item, feeling: value(item) + item.lift(feeling)

    def _looked_up(self, function: Index) -> Callable[[Item], float]:
        @memoised
        def value(item: Item) -> float:
            belief = padded([item.belief], self.models.like.shape[1])
            row: Ints = np.array([item.row], dtype=np.int64)
            found: Floats = index.values(function, 0, row, belief)
            return float(found[0])

        return value
