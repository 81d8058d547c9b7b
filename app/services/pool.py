"""The items that a choice may be made from, counted by model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from policies import Ints

NOBODY = np.empty(0, np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Pool:
    """Items by serial.

    serials:  (n,) ascending
    by_model: for each model row its items, ascending
    excluded: (x,) items of the pool that may not be chosen, ascending
    """

    serials: Ints
    by_model: Sequence[Ints]
    excluded: Ints

    @classmethod
    def of(cls, serials: Ints, model: Ints, models: int) -> "Pool":
        """Items given by serial, ascending; `model` is the row of every item."""
        rows = model[serials]
        order = np.argsort(rows, kind="stable")
        ends = np.searchsorted(rows[order], np.arange(models + 1))
        ordered = serials[order]
        return cls(
            serials,
            [ordered[ends[m] : ends[m + 1]] for m in range(models)],
            NOBODY,
        )

    @property
    def is_empty(self) -> bool:
        return len(self.serials) == len(self.excluded)

    def without(self, excluded: Ints) -> "Pool":
        """What is left of it when these items may not be chosen either."""
        inside = excluded[_within(self.serials, excluded)]
        return Pool(self.serials, self.by_model, np.union1d(self.excluded, inside))

    def holds(self, serials: Ints) -> NDArray[np.bool_]:
        """Which of these items may be chosen."""
        inside = _within(self.serials, serials)
        return inside & ~_within(self.excluded, serials)

    def member(self, model: int, number: int, *, taken: Ints) -> int:
        """Serial of the number-th item of a model that is neither taken nor excluded.

        Costs what is taken, never the size of the pool.
        """
        held = self.by_model[model]
        gone = np.concatenate((taken, self.excluded))
        gone = np.sort(gone[_within(held, gone)])
        for place in np.searchsorted(held, gone).tolist():
            if place > number:
                break
            number += 1
        return int(held[number])


def _within(sorted_serials: Ints, serials: Ints) -> NDArray[np.bool_]:
    if len(sorted_serials) == 0:
        return np.zeros(len(serials), np.bool_)
    places = np.searchsorted(sorted_serials, serials)
    places[places == len(sorted_serials)] = 0
    return np.equal(sorted_serials[places], serials)
