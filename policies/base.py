"""Base policies: what a rollout imagines to be played after its first play."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

from policies import index, subsidy
from policies.index import Index
from policies.model_set import ModelSet
from policies.relaxation import (
    Relaxation,
    least_of,
    price_advantages,
    price_values,
    priced_advantage,
    priced_value,
    relaxed,
)
from policies.situation import Situation
from policies.tables import Tables

Base: TypeAlias = Literal[
    "myopic", "whittle", "lagrangian", "best_fixed", "round_robin"
]
LOOKED_UP = frozenset(("whittle", "lagrangian"))
BY_MOOD = frozenset(("myopic", "whittle", "lagrangian"))


class Imagined(NamedTuple):
    """What bases play by, in one situation.

    Attributes:
        scores: of B bases, then the worth of an item at a leaf.
        price: of rest, 0.0 where none is needed.
    """

    scores: Index
    price: float


@dataclass(frozen=True, slots=True, eq=False)
class Bases:
    """B base policies, ready for their models.

    Attributes:
        scores: of them, then the worth of an item at a leaf: played for ever, or its
            part of the Lagrangian bound.
        by_rest: whether one of them goes by rest.
        relaxation: of the models.
        priced: the rows of `scores` that depend on the price, and whether they are
            advantages.
    """

    scores: Index
    by_rest: bool
    relaxation: Relaxation
    priced: Sequence[tuple[int, bool]]

    @classmethod
    def of(
        cls,
        names: Sequence[Base],
        models: ModelSet,
        tables: Tables,
        discount: float,
        *,
        bounded: bool = False,
    ) -> "Bases":
        """Prepare bases by name, and a leaf: `bounded`, or else played for ever.

        Where a model is not indexable, Whittle's index says nothing: then the
        Lagrangian index takes its place.

        Raises:
            ValueError: the tables are needed, and not of these models.
        """
        if bounded or LOOKED_UP & {*names}:
            tables.check(models)
        relaxation = relaxed(models, tables)
        if not tables.indexable:
            usual = ("lagrangian" if name == "whittle" else name for name in names)
            names = tuple(dict.fromkeys(usual))
        ever = index.linear(subsidy.worth(models, discount))
        known = {
            "myopic": lambda: index.linear(models.like),
            "best_fixed": lambda: ever,
            "round_robin": lambda: index.by_rest(*models.like.shape),
            "whittle": lambda: index.tabled(tables.whittle, models.like.shape[1]),
            "lagrangian": lambda: priced_advantage(relaxation, 0.0),
        }
        scores = [
            index.by_mood(known[name]()) if name in BY_MOOD else known[name]()
            for name in names
        ]
        leaf = priced_value(relaxation, 0.0) if bounded else ever
        priced = [(b, True) for b, name in enumerate(names) if name == "lagrangian"]
        return cls(
            index.together([*scores, leaf]),
            "round_robin" in names,
            relaxation,
            [*priced, *([(len(names), False)] if bounded else [])],
        )

    def imagined(self, situation: Situation) -> Imagined:
        """Price the items as they stand, if anything depends on it."""
        if not self.priced:
            return Imagined(self.scores, 0.0)
        price = least_of(self.relaxation, situation).price
        kept = self.scores
        scores = Index(kept.worth.copy(), kept.place.copy(), kept.steps, kept.values)
        for row, advantage in self.priced:
            fill = price_advantages if advantage else price_values
            fill(self.relaxation, price, scores, row)
        return Imagined(scores, price)
