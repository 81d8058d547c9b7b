"""Monte Carlo rollout: play each item once in imagination, then follow a base policy.

Meshram and Kaza (2021), "Monte Carlo Rollout Policy for Recommendation Systems with
Dynamic User Behavior", arXiv:2102.04321, section III-B. After its first play, of an
item a with belief pi, a trajectory l follows the base policy, and

    Q(a) = r_a(pi) + beta/L sum_l sum_h beta^(h-1) R(h, l)

The paper leaves open which play comes with h = 1. In the reading "tail" it is the
base's first, and the base plays H times: Bellman's equation. In the reading "literal"
it is that of a itself, whose reward so counts twice, and the base plays H - 1 times.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np

from policies.arrays import Floats
from policies.base import LOOKED_UP, Base, Bases, Imagined
from policies.compiled import compiled
from policies.draws import draw, empty_draws
from policies.groups import Groups, distinct, groups_of
from policies.model_set import ModelSet
from policies.moves import Moves, moves
from policies.parameters import Bounds, check
from policies.policy import Scorer
from policies.situation import Situation
from policies.tables import Tables
from policies.trajectories import sampled, total_reward
from policies.tree import NO_LEAF, Now, Tree, now_of, planted

MOST_PLAYS = 50_000  # in imagination, for each first play: seconds for many items


class Plan(NamedTuple):
    """A rollout's parameters as compiled code takes them; see `Rollout`."""

    levels: int
    trajectories: int
    discount: float
    random: bool
    by_rest: bool
    click: bool
    common: bool
    literal: bool
    halving: bool


@dataclass(frozen=True, slots=True)
class Rollout:
    """Scores an item by the mean discounted reward of trajectories that play it first.

    Answers are drawn from the beliefs, and beliefs move by them. The items of a group
    share a score. A base breaks ties by the lowest group row, then untouched before
    touched items; the random base is uniform over items. With M plays a slot, the items
    of the slot are chosen one by one, and `horizon` still counts plays, not slots. A
    play is chosen, earns and is answered in the mood that the answers before it have
    led to.

    Attributes:
        base: policy followed after the first play, phi.
        horizon: H.
        trajectories: L.
        discount: beta.
        reward: R is the expected reward of the item played, or that of the signal
            drawn.
        common_random_numbers: whether all first actions see the same random numbers.
        reading: see the module.
        allocation: whether all first actions get L trajectories, or the better half
            those of the others, again and again: sequential halving (Karnin, Koren and
            Somekh 2013). The last one left has the highest score.
    """

    presets: ClassVar[Mapping[str, Mapping[str, object]]] = MappingProxyType(
        {
            "paper": MappingProxyType(
                {
                    "base": "myopic",
                    "horizon": 5,
                    "trajectories": 100,
                    "reward": "click",
                    "common_random_numbers": False,
                    "reading": "tail",
                    "allocation": "equal",
                }
            )
        }
    )
    is_index: ClassVar[bool] = False

    base: Annotated[Literal[Base, "random"], "policy followed after the first play"] = (
        "myopic"
    )
    horizon: Annotated[
        int, Bounds(1, 50), "plays of the base policy in one trajectory"
    ] = 5
    trajectories: Annotated[
        int, Bounds(1, 10_000), "imagined futures of each first play"
    ] = 100
    discount: Annotated[
        float,
        Bounds(0, 1, below=True),
        "worth of a like in the next slot against one now",
    ] = 0.95
    reward: Annotated[
        Literal["expected", "click"],
        "what an imagined play earns: its chance of a like, or the answer drawn",
    ] = "expected"
    common_random_numbers: Annotated[
        bool, "compare all first plays under the same random numbers: less noise"
    ] = True
    reading: Annotated[
        Literal["tail", "literal"],
        "first reward of a trajectory: the base's, or once more the first play's",
    ] = "tail"
    allocation: Annotated[
        Literal["equal", "halving"],
        "trajectories of a first play: as many for all, or more for the better ones",
    ] = "equal"

    def __post_init__(self) -> None:
        check(self)
        if self.horizon * self.trajectories > MOST_PLAYS:
            raise ValueError(
                f"trajectories: times horizon must be at most {MOST_PLAYS},"
                f" not {self.horizon * self.trajectories}"
            )

    @property
    def rest_matters(self) -> bool:
        """Whether the base goes by rest."""
        return self.base == "round_robin"

    @property
    def table_discount(self) -> float | None:
        """The discount, if the base is looked up in tables."""
        return self.discount if self.base in LOOKED_UP else None

    def prepare(self, models: ModelSet, tables: Tables) -> Scorer:
        """Prepare the base."""
        name = "myopic" if self.base == "random" else self.base
        plan = Plan(
            self.horizon + (self.reading == "tail"),
            self.trajectories,
            float(self.discount),
            self.base == "random",
            self.rest_matters,
            self.reward == "click",
            self.common_random_numbers,
            self.reading == "literal",
            self.allocation == "halving",
        )
        bases = Bases.of((name,), models, tables, self.discount)
        return partial(_scored, bases, plan, moves(models))

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        groups = len(situation.model)
        plays = drawn = self.trajectories * (self.horizon + 1)
        if self.base != "random":  # trajectories share their first plays
            depths = range(self.horizon + 1)
            plays = sum(min(2**h, self.trajectories) for h in depths)
        sets = 1 if self.common_random_numbers else groups
        touched = max(1.0, (self.horizon - 1) / 4)  # a play moves all before it
        return 5 + touched * (0.05 * plays * groups + 0.015 * drawn * sets)


def _scored(
    bases: Bases, plan: Plan, steps: Moves, situation: Situation, seed: int
) -> Floats:
    imagined = bases.imagined(situation)
    return _scores(plan, imagined, steps, groups_of(situation), now_of(situation), seed)


@compiled
def _scores(
    plan: Plan, imagined: Imagined, steps: Moves, groups: Groups, now: Now, seed: int
) -> Floats:
    scores = np.empty(len(groups.model))
    if len(scores) == 0:
        return scores
    row = np.arange(len(scores))
    alike = groups
    if not plan.random:  # which numbers the items by group
        alike, row = distinct(groups, plan.by_rest)
    index, levels = imagined.scores, plan.levels
    tree = planted(steps, alike, index, NO_LEAF, now, levels, plan.discount)
    found = _halved(tree, plan, seed) if plan.halving else _equal(tree, plan, seed)
    for g in range(len(row)):
        scores[g] = found[row[g]]
    return scores


@compiled
def _equal(tree: Tree, plan: Plan, seed: int) -> Floats:
    """Score each first action by as many trajectories."""
    draws = empty_draws(plan.levels, plan.trajectories, plan.random)
    sample = sampled(tree, draws, plan.literal, plan.click, plan.discount)
    scores = np.empty(len(tree.group))
    for g in range(len(scores)):
        if g == 0 or not plan.common:
            draw(draws, seed, g)
        future = total_reward(tree, sample, g, 0, plan.trajectories)
        scores[g] = tree.schedule.reward[g] + future / plan.trajectories
    return scores


@compiled
def _halved(tree: Tree, plan: Plan, seed: int) -> Floats:
    """Score first actions in rounds, each for the better half of the last one.

    A round has an equal share of all trajectories. One that is out is scored below all
    that stay.
    """
    total = len(tree.group)
    rounds = 0
    while 2**rounds < total:
        rounds += 1
    rounds = max(rounds, 1)
    budget, most, staying = plan.trajectories * total, 0, total
    for _ in range(rounds):
        most += max(budget // (staying * rounds), 1)
        staying = (staying + 1) // 2
    draws = empty_draws(plan.levels, most, plan.random)
    sample = sampled(tree, draws, plan.literal, plan.click, plan.discount)
    order, scores, futures = np.arange(total), np.empty(total), np.zeros(total)
    if plan.common:
        draw(draws, seed, 0)
    staying, done = total, 0
    for _ in range(rounds):
        more = max(budget // (staying * rounds), 1)
        for place in range(staying):
            g = order[place]
            if not plan.common:
                draw(draws, seed, g)
            futures[g] += total_reward(tree, sample, g, done, done + more)
            scores[g] = tree.schedule.reward[g] + futures[g] / (done + more)
        order[:staying] = order[:staying][np.argsort(-scores[order[:staying]])]
        staying, done = (staying + 1) // 2, done + more
    for place in range(1, total):
        below = np.nextafter(scores[order[place - 1]], -np.inf)
        scores[order[place]] = min(scores[order[place]], below)
    return scores
