"""How fast a policy decides here, against what it says of itself.

A policy foretells its time roughly, for some processor. What it then takes is measured,
and the ratio of the two is followed, in logarithms: one stall among many decisions says
little. What was not measured for a while is trusted less and less, so that a policy
that was too slow is tried again.
"""

import math
import time
from dataclasses import dataclass

FOLLOWED = 8  # measurements, about, that a ratio is the mean of
HALF_LIFE = 30.0  # seconds after which half of a ratio's logarithm is left
LEAST = 1e-6  # seconds


@dataclass(slots=True)
class Pace:
    """The ratio of measured to foretold seconds, of one policy in this process."""

    measured: int = 0
    logarithm: float = 0.0
    at: float = 0.0

    def foretell(self, cost: float) -> float:
        """Seconds that a decision takes if its policy says so many microseconds."""
        age = max(time.monotonic() - self.at, 0.0)
        return _seconds(cost) * math.exp(self.logarithm * 0.5 ** (age / HALF_LIFE))

    def learn(self, cost: float, took: float) -> None:
        """Take in how many seconds one took."""
        weight = 1 / min(self.measured + 1, FOLLOWED)
        ratio = math.log(max(took, LEAST) / _seconds(cost))
        self.logarithm += weight * (ratio - self.logarithm)
        self.measured += 1
        self.at = time.monotonic()


def _seconds(cost: float) -> float:
    return max(cost * 1e-6, LEAST)
