"""Uniformly random play: the baseline nobody may leave out."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from policies.arrays import Floats
from policies.model_set import ModelSet
from policies.policy import Scorer
from policies.situation import Situation
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class Uniform:
    """Scores all items alike, so that each is equally likely to be played."""

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = True
    table_discount: ClassVar[None] = None

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        """Return the scorer; there is nothing to compute."""
        return self._scores

    def cost(self, _situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        return 1.0

    def _scores(self, situation: Situation, _seed: int) -> Floats:
        return np.zeros(len(situation.model))
