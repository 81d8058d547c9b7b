"""What a policy is."""

from typing import Protocol, runtime_checkable

from policies.arrays import Floats
from policies.choice import Mixture
from policies.model_set import ModelSet
from policies.situation import Situation
from policies.tables import Tables


class Scorer(Protocol):
    """A policy that is ready for one model set."""

    def __call__(self, situation: Situation, seed: int, /) -> Floats | Mixture:
        """Return (G,) finite scores; the highest is played, ties by lot.

        A policy that chooses at random returns a mixture of scores, and so tells with
        which probability each item is chosen.
        """


@runtime_checkable
class Policy(Protocol):
    """A frozen dataclass of parameters, checked when it is made.

    Each parameter has a default and is declared as `policies.parameters` says.
    """

    def __hash__(self) -> int:
        """Equal parameters make equal policies."""

    @property
    def is_index(self) -> bool:
        """Whether a group's score depends on that group alone."""

    @property
    def rest_matters(self) -> bool:
        """Whether a score depends on `Situation.rested`.

        If not, groups that differ in nothing else may be merged.
        """

    @property
    def table_discount(self) -> float | None:
        """Discount of the index tables that `prepare` has to be given; None: none."""

    def prepare(self, models: ModelSet, tables: Tables, /) -> Scorer:
        """Compute what depends on the models alone; slow, once per model set.

        The tables are those of `models.separated()`: one for each sample of a model,
        which `thompson` tells apart. Without samples, one for each model.
        """

    def cost(self, situation: Situation, /) -> float:
        """Estimate the microseconds that scoring `situation` takes, roughly."""
