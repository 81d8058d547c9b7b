"""The item that would earn most if it were played for ever.

Without a decision to make, the belief moves by P1 on average, so the worth is
pi (I - beta P1)^-1 rho: exact, and a baseline that Meshram and Kaza (2021) leave out.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from policies import subsidy
from policies.arrays import Floats
from policies.index import linear, values
from policies.model_set import ModelSet
from policies.parameters import Bounds, check
from policies.policy import Scorer
from policies.situation import Situation
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class BestFixed:
    """Scores an item by the discounted likes of playing it in every slot from now on.

    Attributes:
        discount: beta.
    """

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = True
    table_discount: ClassVar[None] = None

    discount: Annotated[
        float,
        Bounds(0, 1, below=True),
        "worth of a like in the next slot against one now",
    ] = 0.95

    def __post_init__(self) -> None:
        check(self)

    def prepare(self, models: ModelSet, _tables: Tables) -> Scorer:
        """Solve (I - beta P1) v = rho for the worth v of each state, once."""
        worth = linear(subsidy.worth(models, self.discount))

        def scores(situation: Situation, _seed: int) -> Floats:
            return values(worth, 0, situation.model, situation.belief)

        return scores

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        return 5.0 + 0.02 * len(situation.model)
