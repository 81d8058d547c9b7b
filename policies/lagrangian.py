"""The Lagrangian index: what a play is worth at the price of the relaxed problem.

Brown and Smith (2020), "Index policies and performance bounds for dynamic selection
problems". The index is defined for every model, indexable or not. At a price that is
kept, several items tie at zero, and how such ties are broken decides (12.5 likes of
13.0 in the paper's example 3). Here the price is set anew for each decision, where the
Lagrangian bound of the present beliefs is least: that breaks the ties by what has been
answered since (13.0 of 13.0). Exact ties are broken by lot.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from policies.advantage import by_advantage
from policies.index_table import MOST_DISCOUNT
from policies.model_set import ModelSet
from policies.parameters import Bounds, check
from policies.policy import Scorer
from policies.relaxation import relaxed
from policies.situation import Situation
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class Lagrangian:
    """Scores an item by the advantage of playing it over resting it, at a price.

    Both are of the mean mood; what the present mood adds to the reward is added.

    Attributes:
        discount: beta.
    """

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = False

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
        """Compute the advantages at all prices.

        Raises:
            ValueError: the tables are not of these models.
        """
        tables.check(models)
        return by_advantage(relaxed(models, tables))

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        return 10.0 + 2.0 * len(situation.model)
