"""Exact rollout: every future of a base policy, not a sample of them.

Meshram and Kaza (2021), arXiv:2102.04321, section III-B, sample L trajectories of a
base policy after each first play. With a base that breaks ties by rule, a play has one
future for each sequence of answers: H plays of likes and skips have 2^H, fewer than the
trajectories that a comparison needs, and no noise. Rollout improves on its base
(Bertsekas and Castanon 1999); over several bases it is parallel rollout (Chang, Givan
and Chong 2004), which improves on each of them.
"""

from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np

from policies import subsidy
from policies.advantage import by_advantage
from policies.arrays import Floats
from policies.base import LOOKED_UP, Base, Bases, Imagined
from policies.choice import Mixture
from policies.compiled import compiled
from policies.groups import Groups, distinct, groups_of
from policies.index_table import MOST_DISCOUNT
from policies.lookahead import Ceiling, first_plays
from policies.model_set import ModelSet
from policies.moves import Moves, moves
from policies.parameters import Bounds, check
from policies.policy import Scorer
from policies.situation import Situation
from policies.tables import Tables
from policies.tree import (
    ITEM_LEAF,
    NO_LEAF,
    SUM_LEAF,
    Now,
    now_of,
    planted,
    sum_at_rest,
)

LEAVES = {"none": NO_LEAF, "base": ITEM_LEAF, "lagrangian": SUM_LEAF}
MOST_FUTURES = 4096  # of one play, however many signals there are
FEW_FUTURES = 256  # of the plays that fill a slot up
MOST_TRIED = 100_000  # first plays and their answers
MOST_PLAYS = 300_000  # imagined in all, but for those that are pruned
PLAY = 0.1  # microseconds


class Plan(NamedTuple):
    """An exact rollout, ready for its models, as compiled code takes it.

    Attributes:
        by_rest: whether rest tells groups apart.
        leaf: see `Tree`.
        depth: D.
        levels: plays on a path, the candidate's included.
        signals: of the model that has the most.
        discount: beta.
        prune: whether to leave out what cannot win.
        ceiling: how to know.
    """

    by_rest: bool
    leaf: int
    depth: int
    levels: int
    signals: int
    discount: float
    prune: bool
    ceiling: Ceiling


@dataclass(frozen=True, slots=True)
class ExactRollout:
    """Scores an item by the discounted rewards of playing it, then following a base.

    The first plays may be chosen by full look-ahead instead of the base. A group that
    cannot win is scored by what it is worth at most. With M plays a slot, the items of
    the slot are chosen one by one, and `horizon` still counts plays, not slots; but the
    leaf "lagrangian" has a slot followed to its end. Where that would have too many
    futures, items are scored by their Lagrangian advantage.

    Where models have a mood, every play on a path is chosen, earns and is answered in
    the mood that the answers before it have led to. The leaf values items as in their
    mean mood: it is a guess then, the leaf "lagrangian" no bound.

    Attributes:
        base: policies followed after the first plays; of several, the best one for
            what has been answered by then.
        horizon: H.
        depth: D.
        leaf: what is earned after the horizon: nothing; the worth of playing for ever
            what the base would play next; or the Lagrangian bound.
        discount: beta.
    """

    is_index: ClassVar[bool] = False

    base: Annotated[
        Base | tuple[Base, ...],
        "policy followed after the first plays; of several, the best at that point",
    ] = ("whittle", "lagrangian")
    horizon: Annotated[
        int,
        Bounds(1, 12),
        "plays of the base policy; fewer where there would be too many futures",
    ] = 3
    depth: Annotated[
        int, Bounds(1, 3), "first plays that are chosen by trying all of them"
    ] = 1
    leaf: Annotated[
        Literal["none", "base", "lagrangian"],
        "earned after the horizon: nothing, the base's next item for ever, or a bound",
    ] = "lagrangian"
    discount: Annotated[
        float,
        Bounds(0, MOST_DISCOUNT),
        "worth of a like in the next slot against one now",
    ] = 0.95

    def __post_init__(self) -> None:
        if isinstance(self.base, list):  # as JSON has it
            object.__setattr__(self, "base", tuple(self.base))
        check(self)

    @property
    def bases(self) -> tuple[Base, ...]:
        """The base policies."""
        return self.base if isinstance(self.base, tuple) else (self.base,)

    @property
    def rest_matters(self) -> bool:
        """Whether a base goes by rest."""
        return "round_robin" in self.bases

    @property
    def table_discount(self) -> float | None:
        """The discount, if a base or the leaf is looked up in tables."""
        needed = LOOKED_UP & {*self.bases, self.leaf}
        return self.discount if needed else None

    def prepare(self, models: ModelSet, tables: Tables, prune: bool = True) -> Scorer:
        """Stack the bases, and work out what no play can exceed.

        Args:
            models: M models.
            tables: of them, if needed.
            prune: whether to leave out candidates that cannot win.
        """
        bounded = self.leaf == "lagrangian"
        bases = Bases.of(self.bases, models, tables, self.discount, bounded=bounded)
        signals = int(models.signals.max(initial=2))
        most = int(np.log(MOST_FUTURES) / np.log(signals))
        ever = subsidy.worth(models, self.discount).max(axis=1, initial=0.0)
        plan = Plan(
            bases.by_rest,
            LEAVES[self.leaf],
            self.depth,
            self.depth + min(self.horizon, most),
            signals,
            float(self.discount),
            prune,
            Ceiling(_next_reward(models), ever),
        )
        return partial(_scored, bases, plan, moves(models))

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        groups = len(situation.model)
        plays = self.horizon + 1
        if self.leaf == "lagrangian":
            plays = max(plays, min(situation.slate.plays, FEW_FUTURES.bit_length()))
        tried = min(groups, 20) * (2.0 * groups) ** (self.depth - 1)
        imagined = min(tried * 2.0**plays, MOST_PLAYS)
        each = 0.4 if self.table_discount is None else 1.6
        return 10.0 + each * groups + len(self.bases) * PLAY * imagined


def _next_reward(models: ModelSet) -> Floats:
    """Return (M,): the reward that no item can exceed in the next slot."""
    like = models.most_like[..., None]
    after = np.maximum(models.play @ like, models.rest @ like)
    most: Floats = after[..., 0].max(axis=1, initial=0.0)
    return most


def _scored(
    bases: Bases, plan: Plan, steps: Moves, situation: Situation, seed: int
) -> Floats | Mixture:
    fitted = _fitted(plan, situation)
    if fitted is None:
        return by_advantage(bases.relaxation)(situation, seed)
    imagined = bases.imagined(situation)
    return _scores(fitted, imagined, steps, groups_of(situation), now_of(situation))


def _fitted(plan: Plan, situation: Situation) -> Plan | None:
    """Return a plan that looks no further than it may, in a situation.

    With the leaf "lagrangian" all items have to stand in one slot: a path goes on to
    the end of a slot. None: then it has too many futures.
    """
    follow, branches = plan.levels - plan.depth, len(situation.model) * plan.signals
    for depth in range(plan.depth, 0, -1):
        tried = branches**depth
        if depth > 1 and tried > MOST_TRIED:
            continue
        after = follow
        while after > 1 and tried * plan.signals**after > MOST_PLAYS:
            after -= 1
        if plan.leaf != SUM_LEAF:
            return _looking(plan, depth, depth + after)
        more = _until_the_slot_ends(depth + after, situation)
        futures = plan.signals ** (after + more)
        if more == 0 or (futures <= FEW_FUTURES and tried * futures <= MOST_PLAYS):
            return _looking(plan, depth, depth + after + more)
    return None


def _looking(plan: Plan, depth: int, levels: int) -> Plan:
    if (depth, levels) == (plan.depth, plan.levels):
        return plan
    return plan._replace(depth=depth, levels=levels)


def _until_the_slot_ends(levels: int, situation: Situation) -> int:
    """Return the plays that are missing in a slot after a path of so many."""
    slate = situation.slate
    if slate.plays == 1:
        return 0
    chosen = len(slate.model)
    plays = min(slate.plays, int(situation.count.sum()) + chosen)
    return -(chosen + levels) % max(plays, 1)


@compiled
def _scores(
    plan: Plan, imagined: Imagined, steps: Moves, groups: Groups, now: Now
) -> Floats:
    scores = np.empty(len(groups.model))
    if len(scores) == 0:
        return scores
    alike, row = distinct(groups, plan.by_rest)
    index, levels = imagined.scores, plan.levels
    tree = planted(steps, alike, index, plan.leaf, now, levels, plan.discount)
    if plan.leaf == SUM_LEAF:
        items = alike.size.sum() + len(now.model)
        plays = min(now.plays, items)
        paid = imagined.price * (items - plays) / (1 - plan.discount)
        tree.constant[0] = sum_at_rest(tree) - paid
    found = first_plays(tree, plan.depth, plan.ceiling, plan.prune)
    for g in range(len(row)):
        scores[g] = found[row[g]]
    return scores
