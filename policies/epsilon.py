"""Follow another policy, but now and then play anything: to learn what it never plays.

What is logged so lets any policy be judged from the log, as every item has a chance.
"""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from policies.choice import Mixture, mixed
from policies.model_set import ModelSet
from policies.myopic import Myopic
from policies.parameters import Bounds, check
from policies.policy import Policy, Scorer
from policies.situation import Situation
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class Epsilon:
    """Plays any candidate with chance epsilon, else the choice of another policy.

    Attributes:
        epsilon: chance of a play that is uniform over all candidate items.
        policy: the other policy.
    """

    epsilon: Annotated[
        float, Bounds(0, 1), "chance of a play that is uniform over all candidates"
    ] = 0.1
    policy: Annotated[Policy, "policy followed otherwise"] = field(
        default_factory=Myopic
    )

    def __post_init__(self) -> None:
        check(self)

    @property
    def rest_matters(self) -> bool:
        """Whether it does to the policy followed."""
        return self.policy.rest_matters

    @property
    def is_index(self) -> bool:
        """Whether the policy followed is one."""
        return self.policy.is_index

    @property
    def table_discount(self) -> float | None:
        """That of the policy followed."""
        return self.policy.table_discount

    def prepare(self, models: ModelSet, tables: Tables) -> Scorer:
        """Prepare the policy followed."""
        follow = self.policy.prepare(models, tables)
        weight = (1.0 - self.epsilon, self.epsilon)

        def scores(situation: Situation, seed: int) -> Mixture:
            anything = np.zeros(len(situation.model))
            return mixed(weight, (follow(situation, seed), anything))

        return scores

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        return 5.0 + self.policy.cost(situation)
