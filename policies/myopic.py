"""The item most likely to be liked now.

Meshram and Kaza (2021), arXiv:2102.04321, section III-A.
"""

from dataclasses import dataclass
from typing import ClassVar

from policies.arrays import Floats
from policies.bayes import expected_like
from policies.model_set import ModelSet
from policies.policy import Scorer
from policies.situation import Situation
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class Myopic:
    """Scores an item by its chance of a like in this slot, r(pi), in this mood."""

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = True
    table_discount: ClassVar[None] = None

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        """Return the scorer; there is nothing to compute."""
        return self._scores

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        return 2.0 + 0.01 * len(situation.model)

    def _scores(self, situation: Situation, _seed: int) -> Floats:
        like = situation.models.like_in
        return expected_like(like, situation.chances, situation.belief)
