"""Encore: beliefs by its filter, choices by one of its policies."""

from collections.abc import Sequence

import numpy as np

from benchmarks.peers.competitor import Competitor, Run
from benchmarks.peers.worlds import ITEMS, Seed, mistaken
from policies import (
    LIKE,
    NEVER,
    POLICIES,
    SKIP,
    Model,
    ModelSet,
    Scorer,
    Situation,
    answered,
    build_all,
    choose,
    create,
    rested,
    untouched,
)

BLIND = ("random", "round_robin")  # use no parameters: they show where the floor is
BY_CHANCE = ("epsilon", "thompson", "whittle_mc")
DEFAULT = [name for name in POLICIES if name not in BY_CHANCE]
STARTS = {"the truth": 0.0, "10 % wrong": 0.1, "20 % wrong": 0.2, "30 % wrong": 0.3}
ROWS = np.arange(ITEMS)
ONES = np.ones(ITEMS, dtype=np.int64)


class Encore:
    def __init__(self, models: ModelSet, scorer: Scorer, seed: int) -> None:
        self.models = models
        self.scorer = scorer
        self.seed = seed
        self.greet()

    def greet(self) -> None:
        self.belief = untouched(self.models, 0)
        self.rested = np.full(ITEMS, NEVER)

    def choose(self) -> int:
        self.seed += 1
        situation = Situation(self.models, ROWS, self.belief, ONES, self.rested)
        return choose(self.scorer(situation, self.seed), ONES, self.seed).group

    def learn(self, item: int, *, liked: bool) -> None:
        signal = LIKE if liked else SKIP
        after = answered(self.models, item, self.belief[item], signal).belief
        self.belief = rested(self.models, ROWS, self.belief, ONES)
        self.belief[item] = after
        self.rested = self.rested + (self.rested < NEVER)
        self.rested[item] = 0


def competitors(
    names: Sequence[str],
    catalogues: Sequence[Sequence[Model]],
    seeds: Sequence[Seed],
) -> list[Competitor]:
    """Enter policies, each with parameters that are true and ever more wrong.

    Args:
        names: of the policies.
        catalogues: the true models of each.
        seeds: of the mistakes about each.
    """
    entered = []
    for start, share in STARTS.items():
        known = [
            ModelSet.of(mistaken(models, share, seed))
            for models, seed in zip(catalogues, seeds, strict=True)
        ]
        able = [name for name in names if name not in BLIND or share == 0]
        for name, scorers in prepared(able, known).items():
            knows = "nothing" if name in BLIND else start
            entered.append(competitor(name, knows, known, scorers))
    return sorted(entered, key=lambda entry: names.index(entry.setting))


def prepared(
    names: Sequence[str], known: Sequence[ModelSet]
) -> dict[str, list[Scorer]]:
    """Prepare policies for each catalogue; those of one discount share its tables."""
    scorers: dict[str, list[Scorer]] = {name: [] for name in names}
    policies = {name: create(name, {}) for name in names}
    for models in known:
        discounts = {policy.table_discount for policy in policies.values()}
        tables = {discount: build_all(models, discount) for discount in discounts}
        for name, policy in policies.items():
            ready = policy.prepare(models, tables[policy.table_discount])
            scorers[name].append(ready)
    return scorers


def competitor(
    name: str, start: str, known: Sequence[ModelSet], scorers: Sequence[Scorer]
) -> Competitor:
    def begin(run: Run) -> Encore:
        return Encore(known[run.catalogue], scorers[run.catalogue], run.seed)

    return Competitor(f"Encore `{name}`", start, name, begin, encore=True)
