"""Monte Carlo rollout: play each item once in imagination, then follow a base policy.

Meshram and Kaza (2021), "Monte Carlo Rollout Policy for Recommendation Systems with
Dynamic User Behavior", arXiv:2102.04321, section IV. After its first play, of an item a
with belief pi, a trajectory l follows the base policy, and

    Q(a) = r_a(pi) + beta/L sum_l sum_h beta^(h-1) R(h, l)

The paper leaves open which play comes with h = 1. In the reading "tail" it is the
base's first, and the base plays H times: Bellman's equation. In the reading "literal"
it is that of a itself, whose reward so counts twice, and the base plays H - 1 times.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from policies.arrays import Floats
from policies.compiled import compiled
from policies.draws import Plan, draw, empty_draws
from policies.model_set import ModelSet
from policies.parameters import Bounds, check
from policies.path import Imagined, empty_path
from policies.policy import Scorer
from policies.schedule import Groups, scheduled
from policies.situation import Situation
from policies.tables import Tables
from policies.trajectories import total_reward

MOST_PLAYS = 50_000  # in imagination, for each first play: seconds for many items


@dataclass(frozen=True, slots=True)
class Rollout:
    """Scores an item by the mean discounted reward of trajectories that play it first.

    Answers are drawn from the beliefs, and beliefs move by them. The items of a group
    share a score. The myopic base breaks ties by the lowest group row, then untouched
    before touched items; the random base is uniform over items.

    Attributes:
        base: policy followed after the first play, phi.
        horizon: H.
        trajectories: L.
        discount: beta.
        reward: R is the expected like of the item played, or the answer drawn.
        common_random_numbers: whether all first actions see the same random numbers.
        reading: see the module.
    """

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = False
    table_discount: ClassVar[None] = None

    base: Annotated[
        Literal["random", "myopic"], "policy followed after the first play"
    ] = "myopic"
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

    def __post_init__(self) -> None:
        check(self)
        if self.horizon * self.trajectories > MOST_PLAYS:
            raise ValueError(
                f"trajectories: times horizon must be at most {MOST_PLAYS},"
                f" not {self.horizon * self.trajectories}"
            )

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        """Return the scorer; the models need no preparation."""
        plan = Plan(
            self._weights(),
            self.trajectories,
            self.base == "random",
            self.reward == "click",
            self.common_random_numbers,
        )

        def scores(situation: Situation, seed: int) -> Floats:
            groups = Groups(situation.model, situation.belief, situation.count)
            return _scores(situation.models, groups, plan, seed)

        return scores

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        groups = len(situation.model)
        plays = drawn = self.trajectories * (self.horizon + 1)
        if self.base == "myopic":  # trajectories share their first plays
            depths = range(self.horizon + 1)
            plays = sum(min(2**h, self.trajectories) for h in depths)
        sets = 1 if self.common_random_numbers else groups
        touched = max(1.0, (self.horizon - 1) / 4)  # a play moves all before it
        return 5 + touched * (0.05 * plays * groups + 0.015 * drawn * sets)

    def _weights(self) -> Floats:
        """Return (D,): worth of the rewards at depth 0 (the first play), 1, 2, ..."""
        depths = np.arange(self.horizon + 1)
        powers: Floats = np.float64(self.discount) ** depths
        if self.reading == "literal":
            return powers[1:]
        powers[0] = 0.0  # the first play's own reward is added once, exactly
        return powers


@compiled
def _scores(models: ModelSet, groups: Groups, plan: Plan, seed: int) -> Floats:
    draws = empty_draws(plan)
    path = empty_path(plan, groups.belief.shape[1])
    schedule = scheduled(models, groups, len(plan.weights))
    imagined = Imagined(models, groups, plan, schedule, draws, path)
    scores = np.empty(len(groups.model))
    for g in range(len(scores)):
        if g == 0 or not plan.common:
            draw(draws, seed, g, schedule.last[-1])
        future = total_reward(imagined, g)
        scores[g] = schedule.like[0, g] + future / plan.trajectories
    return scores
