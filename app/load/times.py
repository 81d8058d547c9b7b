"""Times on the way to percentiles, in a histogram of high dynamic range.

Its error is below a thousandth of a time, however long a run is and however rare the
longest ones are; those of several processes and runs add up exactly.
"""

from collections.abc import Mapping
from typing import Self

from hdrh.histogram import HdrHistogram

LEAST, MOST = 1, 3_600_000_000  # microseconds: up to an hour
DIGITS = 3
PERCENTILES = {"p50": 50.0, "p90": 90.0, "p99": 99.0, "p999": 99.9}


class Times:
    """How often something took how long."""

    def __init__(self) -> None:
        self._found = HdrHistogram(LEAST, MOST, DIGITS)

    def __len__(self) -> int:
        count: int = self._found.get_total_count()
        return count

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return Times.decoded, (self.encoded(),)

    @classmethod
    def decoded(cls, encoded: str) -> Self:
        times = cls()
        times._found.decode_and_add(encoded)
        return times

    def encoded(self) -> str:
        """In the format that all HdrHistograms share (V2, deflated, base64)."""
        return str(self._found.encode().decode())

    def add(self, seconds: float) -> None:
        self._found.record_value(min(max(round(seconds * 1e6), LEAST), MOST))

    def merge(self, other: "Times") -> None:
        self._found.add(other._found)  # noqa: SLF001 - another of its kind

    def at(self, percentile: float) -> float:
        """The time, in milliseconds, that so many percent do not exceed; 0: none."""
        return float(self._found.get_value_at_percentile(percentile)) / 1e3

    def described(self) -> Mapping[str, float]:
        """Percentiles, mean and maximum, in milliseconds."""
        if not len(self):
            return {}
        return {
            **{name: self.at(percent) for name, percent in PERCENTILES.items()},
            "max": float(self._found.get_max_value()) / 1e3,
            "mean": round(float(self._found.get_mean_value()) / 1e3, 3),
        }
