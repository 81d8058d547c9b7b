"""Least recently played first."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from policies.arrays import Floats
from policies.model_set import ModelSet
from policies.policy import Scorer
from policies.situation import Situation
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class RoundRobin:
    """Scores an item by the slots since it was last played."""

    rest_matters: ClassVar[bool] = True
    is_index: ClassVar[bool] = True
    table_discount: ClassVar[None] = None

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        """Return the scorer; there is nothing to compute."""
        return self._scores

    def cost(self, _situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        return 1.0

    def _scores(self, situation: Situation, _seed: int) -> Floats:
        return situation.rested.astype(np.float64)
