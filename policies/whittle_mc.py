"""The paper's index: the subsidy for rest at which short simulations see no difference.

Meshram and Kaza (2021), arXiv:2102.04321, section III-C, who take it from their
"Simulation based algorithms for Markov decision processes and multi-action restless
bandits" (2020), arXiv:2007.12933. For the belief of one item and a subsidy W for each
slot of rest,

    Q_a(W) = 1/L sum_l sum_h beta^(h-1) R(h, l, W),   h = 1 ... H

where slot 1 is a play (a = 1) or a rest (a = 0), and from then on the item is played
where its expected reward exceeds W. With steps a_t and b_t, b_t / a_t -> 0,

    Q_a <- Q_a + a_t (its latest estimate - Q_a),   W <- W + b_t (Q_1 - Q_0)

until the difference is small. Answers are drawn once, for both actions, all items and
all steps: so W converges to where these L trajectories earn the same either way, or
where the better way changes; with many of them, to where that is so for the exact sums.

That is not Whittle's index, which `whittle` computes: only H slots count, while at beta
.95 and H 5 three quarters of the weight lie beyond, and plays in them are myopic. In
example 3, Whittle's index of items 1, 3 and 5 is .655, .648 and .654 at the start; from
H = 2, where a myopic play is still the best, it is .584, .605 and .612. That is another
order, and it earns 11.43 where Whittle's index earns the most there is, 12.96.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from policies.arrays import Floats
from policies.indifference import Search, subsidies
from policies.lift import lifted
from policies.model_set import ModelSet
from policies.parameters import Bounds, check
from policies.policy import Scorer
from policies.situation import Situation
from policies.tables import Tables

MOST_DRAWS = 1_000_000  # of one item's answers, over all steps: milliseconds


@dataclass(frozen=True, slots=True)
class WhittleMC:
    """Scores an item by the paper's Monte Carlo estimate of its Whittle index.

    It is of the mean mood; what the present mood adds to the reward is added to it.

    Attributes:
        horizon: H.
        trajectories: L.
        iterations: most steps of W, from the expected reward pi rho on.
        tolerance: W is taken once |Q_1 - Q_0| is below this, averaged and latest.
        discount: beta.
        reward: R of a play is its expected reward, or that of the signal drawn.
    """

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = True
    table_discount: ClassVar[None] = None

    horizon: Annotated[int, Bounds(1, 50), "slots of one trajectory"] = 5
    trajectories: Annotated[
        int, Bounds(1, 10_000), "imagined futures of a play, and of a rest"
    ] = 100
    iterations: Annotated[int, Bounds(1, 10_000), "most steps of the search"] = 100
    tolerance: Annotated[
        float,
        Bounds(0, 1),
        "the search ends when playing and resting earn the same but for this",
    ] = 0.001
    discount: Annotated[
        float,
        Bounds(0, 1, below=True),
        "worth of a like in the next slot against one now",
    ] = 0.95
    reward: Annotated[
        Literal["expected", "click"],
        "what an imagined play earns: its chance of a like, or the answer drawn",
    ] = "expected"

    def __post_init__(self) -> None:
        check(self)
        draws = self.horizon * self.trajectories * self.iterations
        if draws > MOST_DRAWS:
            raise ValueError(
                f"iterations: times horizon times trajectories must be at most"
                f" {MOST_DRAWS}, not {draws}"
            )

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        """Return the scorer; the models need no preparation."""
        search = Search(
            np.float64(self.discount) ** np.arange(self.horizon),
            self.trajectories,
            self.iterations,
            float(self.tolerance),
            self.reward == "click",
        )

        def scores(situation: Situation, seed: int) -> Floats:
            found = subsidies(
                situation.models, situation.model, situation.belief, search, seed
            )
            return lifted(found, situation)

        return scores

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        draws = self.horizon * self.trajectories
        nodes = float(sum(min(2**h, self.trajectories) for h in range(self.horizon)))
        steps = min(self.iterations, 4 * math.sqrt(self.iterations))  # most end before
        each = steps * (0.02 * nodes + 0.003 * draws)
        return 5 + 0.015 * draws + each * len(situation.model)
