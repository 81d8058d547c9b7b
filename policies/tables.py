"""The index tables of all models, stacked for compiled code."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from policies.arrays import Floats
from policies.index_table import MOST_POINTS, IndexTable, build
from policies.layers import Layers, stacked
from policies.model_set import ModelSet


class Tables(NamedTuple):
    """What is known of M models at one discount; see `IndexTable`.

    Attributes:
        whittle: one layer, Whittle's index.
        value: L layers, V at subsidies spread evenly from `low` to `high`.
        low: (M,).
        high: (M,).
        indexable: whether all of them are.
        discount: beta.
    """

    whittle: Layers
    value: Layers
    low: Floats
    high: Floats
    indexable: bool
    discount: float

    @classmethod
    def of(cls, tables: Sequence[IndexTable], discount: float = 0.0) -> "Tables":
        """Stack `tables`; row m of a `ModelSet` goes with the m-th one.

        Raises:
            ValueError: a table is of another discount.
        """
        if any(table.discount != discount for table in tables):
            raise ValueError(f"discount: not all tables are of {discount}")
        states = [table.states for table in tables]
        return cls(
            stacked(states, [t.divisions for t in tables], [t.whittle for t in tables]),
            stacked(
                states, [t.value_divisions for t in tables], [t.value for t in tables]
            ),
            np.array([table.low for table in tables]),
            np.array([table.high for table in tables]),
            all(table.indexable for table in tables),
            float(discount),
        )

    def check(self, models: ModelSet) -> None:
        """Check that there is a table for each row of `models`.

        Raises:
            ValueError: there is not. Models of several samples have tables for each
                sample only, which `thompson` takes up.
        """
        if not np.array_equal(self.whittle.states, models.states):
            raise ValueError("tables: must be of these models, one for each")


NO_TABLES = Tables.of(())


def build_all(
    models: ModelSet,
    discount: float | None,
    most_points: int = MOST_POINTS,
    progress: Callable[[float], object] = lambda _share: None,
) -> Tables:
    """Build the tables of all models at a discount; none if that is None.

    `progress` is told the share of the work that is done, from 0 to 1.
    """
    if discount is None:
        return NO_TABLES
    total, built = len(models.states), []
    for m in range(total):
        advance = partial(_advance, progress, m, total)
        built.append(build(models, m, discount, most_points, progress=advance))
    return Tables.of(built, discount)


def _advance(
    progress: Callable[[float], object], done: int, total: int, share: float
) -> None:
    progress((done + share) / total)
