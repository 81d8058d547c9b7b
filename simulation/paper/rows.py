"""What was found, in a form that files keep."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import hypot
from typing import Any

import numpy as np

from policies import Floats, Situation, create
from simulation.contender import Progress, contenders
from simulation.course import Course, slots_of
from simulation.examples import DISCOUNT
from simulation.listeners import Listeners
from simulation.value import Value, half_width, quantile, value

SEED = 1


@dataclass(frozen=True, slots=True)
class Entry:
    """A policy that is tried, and how often."""

    label: str
    name: str
    params: Mapping[str, object]
    runs: int


@dataclass(frozen=True, slots=True)
class Row:
    """What a policy earned, in discounted rewards.

    Attributes:
        group: of rows that belong together: a start, or a line of a figure.
        label: of the policy.
        x: where the row stands on a line, if it does.
        runs: simulated users.
        mean: of what they earned. If more users met the first policy of the group,
            what these earned corrects the mean, as far as both go together.
        ci95: half the width of a 95 % interval of the mean.
        difference: to the first policy, over the same users.
        difference_ci95: half the width of its interval.
        decision_us: median time of a decision, in microseconds.
        shares: of all plays, by item.
        curve: mean of what was earned by the end of each slot.
        curve_ci95: half the widths of the intervals.
    """

    group: str
    label: str
    x: float | None
    runs: int
    mean: float
    ci95: float
    difference: float
    difference_ci95: float
    decision_us: float
    shares: Sequence[float] = ()
    curve: Sequence[float] = ()
    curve_ci95: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class Part:
    """One part of the reproduction.

    Attributes:
        name: of the part.
        rows: what policies earned.
        marks: single numbers, by name.
        series: several of a kind, by name.
    """

    name: str
    rows: Sequence[Row]
    marks: Mapping[str, float] = field(default_factory=dict)
    series: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return asdict(self)

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> "Part":
        """Return the part that `plain` was made from."""
        rows = [Row(**row) for row in plain["rows"]]
        return cls(plain["name"], rows, plain["marks"], plain["series"])

    def group(self, name: str) -> Sequence[Row]:
        """Return the rows of a group."""
        return [row for row in self.rows if row.group == name]

    def row(self, group: str, label: str, x: float | None = None) -> Row:
        """Return the row of a policy in a group, where `x` says."""
        [found] = [
            row for row in self.group(group) if row.label == label and row.x == x
        ]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Policies before the same listeners.

    Attributes:
        group: of the rows.
        start: as policies believe it.
        entries: the first is what others are compared with.
        listeners: None: as believed.
        slots: None: as many as count.
        x: where the rows stand on a line.
        in_full: whether shares and curves are kept.
        seed: of all random numbers.
    """

    group: str
    start: Situation
    entries: Sequence[Entry]
    listeners: Listeners | None = None
    slots: int | None = None
    x: float | None = None
    in_full: bool = False
    seed: int = SEED

    def rows(self, progress: Progress = lambda _share: None) -> Iterator[Row]:
        """Try the policies, one after the other."""
        policies = [create(entry.name, entry.params) for entry in self.entries]
        ready = contenders(policies, self.start.models)
        slots = self.slots or slots_of(DISCOUNT)
        first: Floats | None = None
        for number, (entry, contender) in enumerate(
            zip(self.entries, ready, strict=True)
        ):
            course = Course(entry.runs, slots, DISCOUNT, self.seed)
            [found] = value([contender], self.start, course, self.listeners, threads=1)
            first = found.rewards if first is None else first
            yield self._row(entry, found, first)
            progress((number + 1) / len(ready))

    def _row(self, entry: Entry, found: Value, first: Floats) -> Row:
        runs = len(found.rewards)
        difference = found.rewards - first[:runs]
        mean, half = corrected(found.rewards, first)
        row = Row(
            group=self.group,
            label=entry.label,
            x=self.x,
            runs=runs,
            mean=mean,
            ci95=half,
            difference=float(difference.mean()),
            difference_ci95=half_width(difference),
            decision_us=found.decision_us,
        )
        if not self.in_full:
            return row
        band = quantile(runs - 1) * found.curve_error
        return replace(
            row,
            shares=found.shares.tolist(),
            curve=np.round(found.curve, 6).tolist(),
            curve_ci95=np.round(band, 6).tolist(),
        )


def corrected(rewards: Floats, first: Floats) -> tuple[float, float]:
    """Return a mean and half its 95 % interval, by a control variate.

    Args:
        rewards: (R,) of a policy.
        first: (Q,) of another, Q >= R, of which the first R met the same users.
    """
    runs = len(rewards)
    if runs == len(first) or first[:runs].std() == 0:
        return float(rewards.mean()), half_width(rewards)
    both = np.cov(rewards, first[:runs])
    share = both[0, 1] / both[1, 1]
    rest = rewards - share * first[:runs]
    half = hypot(half_width(rest), share * half_width(first))
    return float(rest.mean() + share * first.mean()), half
