"""Whittle's index: the subsidy for rest at which a play is no better than a rest.

Whittle (1988), "Restless bandits: activity allocation in a changing world". Meshram and
Kaza (2021) estimate it from short simulations (that is `whittle_mc`); this one comes
from value iteration on a grid of beliefs, carried through to the end. See `subsidy` and
`index_table`.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from policies import index
from policies.advantage import by_advantage
from policies.arrays import Floats
from policies.index_table import MOST_DISCOUNT
from policies.lift import lifted
from policies.model_set import ModelSet
from policies.parameters import Bounds, check
from policies.policy import Scorer
from policies.relaxation import relaxed
from policies.situation import Situation
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class Whittle:
    """Scores an item by its Whittle index, looked up in a table of its model.

    Where a model is not indexable, the index says nothing: then all items are scored by
    their Lagrangian advantage, see `lagrangian`. The table is of the mean mood; what
    the present mood adds to the reward is added to the index.

    Attributes:
        discount: beta.
    """

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = True

    discount: Annotated[
        float,
        Bounds(0, MOST_DISCOUNT),
        "worth of a like in the next slot against one now",
    ] = 0.95

    def __post_init__(self) -> None:
        check(self)

    @property
    def table_discount(self) -> float:
        """The discount."""
        return self.discount

    def prepare(self, models: ModelSet, tables: Tables) -> Scorer:
        """Take up the tables.

        Raises:
            ValueError: they are not of these models.
        """
        tables.check(models)
        if not tables.indexable:
            return by_advantage(relaxed(models, tables))
        whittle = index.tabled(tables.whittle, models.like.shape[1])

        def scores(situation: Situation, _seed: int) -> Floats:
            found = index.values(whittle, 0, situation.model, situation.belief)
            return lifted(found, situation)

        return scores

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        return 5.0 + 0.05 * len(situation.model)
