"""How often somebody may ask: so many requests a second, some of them at once.

Each process counts for itself. The generic cell rate algorithm (ITU-T I.371) keeps one
number for each key or user: the moment at which all that was asked would be due, if it
had been asked evenly.
"""

import math
import time
from dataclasses import dataclass, field

from app.errors import Fault, TooManyRequests

MOST_KEPT = 100_000  # names, before those that wait for nothing are forgotten


@dataclass(slots=True)
class Rate:
    """A limit for each of many.

    of:         what they are, as errors name it
    per_second: requests, None: no limit
    burst_s:    seconds' worth of requests that may come at once
    """

    of: str
    per_second: float | None
    burst_s: float
    _due: dict[str, float] = field(default_factory=dict)
    _most: int = MOST_KEPT

    def take(self, name: str) -> None:
        """Count a request, or refuse it until one is due."""
        if self.per_second is None:
            return
        now = time.monotonic()
        due = self._next(name, now)
        if len(self._due) >= self._most:
            self._due = {each: at for each, at in self._due.items() if at > now}
            self._most = max(MOST_KEPT, 2 * len(self._due))  # seldom, also if all wait
        self._due[name] = due + 1 / self.per_second

    def check(self, name: str) -> None:
        """Refuse a request until one is due, and count none."""
        if self.per_second is not None:
            self._next(name, time.monotonic())

    def _next(self, name: str, now: float) -> float:
        """The moment at which what was asked before would be due, if it is not late."""
        due = max(self._due.get(name, now), now)
        if self.per_second is None:
            return due
        wait = due - now - max(self.burst_s - 1 / self.per_second, 0.0)
        if wait > 0:
            fault = Fault(self.of, f"at most {self.per_second:g} requests a second")
            raise TooManyRequests(
                f"This {self.of} asks too often.", fault, after=math.ceil(wait)
            )
        return due
