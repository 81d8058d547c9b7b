"""How runs go: their number and length, what later rewards are worth, the seed."""

import math
from dataclasses import dataclass

MOST = 2**31  # runs, and slots
LEFT = 1e-4  # worth of a reward after the last slot, against one in the first


def slots_of(discount: float) -> int:
    """Return the least number of slots with discount^slots < 1e-4."""
    if discount == 0:
        return 1
    slots = max(math.floor(math.log(LEFT) / math.log(discount)), 1)
    while discount**slots >= LEFT:
        slots += 1
    return slots


@dataclass(frozen=True, slots=True)
class Course:
    """What all policies meet alike.

    Attributes:
        runs: R.
        slots: T.
        discount: beta.
        seed: of all random numbers; those of one run and slot are the same for all
            policies.
        first: number of the first run: a course can go on where another has ended.
    """

    runs: int
    slots: int
    discount: float
    seed: int
    first: int = 0

    def __post_init__(self) -> None:
        """Check.

        Raises:
            ValueError: names the field at fault.
        """
        if not 2 <= self.runs < MOST:  # noqa: PLR2004 - one has no spread
            raise ValueError(f"runs: must be from 2 to below 2**31, not {self.runs}")
        if not 0 <= self.first <= MOST - self.runs:
            raise ValueError(
                f"first: must be from 0 to 2**31 less the runs, not {self.first}"
            )
        if not 1 <= self.slots < MOST:
            raise ValueError(f"slots: must be from 1 to below 2**31, not {self.slots}")
        if not 0 <= self.discount < 1:
            raise ValueError(
                f"discount: must be from 0 to below 1, not {self.discount}"
            )
        if not 0 <= self.seed < 2**63:
            raise ValueError(f"seed: must be from 0 to below 2**63, not {self.seed}")
