"""What a policy is."""

from typing import ClassVar, Protocol

from policies.arrays import Floats
from policies.model_set import ModelSet
from policies.situation import Situation


class Scorer(Protocol):
    """A policy that is ready for one model set."""

    def __call__(self, situation: Situation, seed: int, /) -> Floats:
        """Return (G,) finite scores; the highest is played, ties by lot."""


class Policy(Protocol):
    """A frozen dataclass of parameters, checked when it is made.

    Each parameter has a default and is declared as `policies.parameters` says.

    Attributes:
        rest_matters: whether a score depends on `Situation.rested`; if not, groups
            that differ in nothing else may be merged.
    """

    rest_matters: ClassVar[bool]

    def prepare(self, models: ModelSet, /) -> Scorer:
        """Compute what depends on the models alone; slow, once per model set."""

    def cost(self, situation: Situation, /) -> float:
        """Estimate the microseconds that scoring `situation` takes, roughly."""
