"""Instances that are drawn, of which there are many: how far policies are apart."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from policies import Model, bound, create
from simulation.contender import Progress, contenders
from simulation.course import Course, slots_of
from simulation.examples import DISCOUNT
from simulation.opening import opening
from simulation.paper.labels import EXACT, MYOPIC, PAPER, PARAMS
from simulation.paper.rows import Part, Row
from simulation.value import Value, half_width, quantile, value

NAMED: Mapping[str, str] = MappingProxyType(
    {"myopic": MYOPIC, "paper": PAPER, "exact": EXACT}
)


@dataclass(frozen=True, slots=True)
class Drawings:
    """Instances.

    Attributes:
        name: of the part.
        draw: the models of an instance by its seed.
        instances: how many.
        runs: of each.
        points: of the grids of their bounds.
    """

    name: str
    draw: Callable[[int], Sequence[Model]]
    instances: int
    runs: int
    points: int


def over(drawings: Drawings, progress: Progress) -> Part:
    """Try policies on all of them: gains over myopic, gaps to the bound, in percent."""
    slots = slots_of(DISCOUNT)
    policies = [create(*PARAMS[label]) for label in NAMED.values()]
    found: dict[str, list[Value]] = {name: [] for name in NAMED}
    gaps: dict[str, list[float]] = {f"gap, {name}": [] for name in NAMED}
    for seed in range(drawings.instances):
        start = opening(drawings.draw(seed))
        most = bound(start, DISCOUNT, 0, drawings.points).value
        ready = contenders(policies, start.models)
        course = Course(drawings.runs, slots, DISCOUNT, seed)
        values = value(ready, start, course, threads=1)
        for name, each in zip(NAMED, values, strict=True):
            found[name].append(each)
            gaps[f"gap, {name}"].append(100 * (1 - each.mean / most))
        progress((seed + 1) / drawings.instances)
    rows = [_on_average(label, found[name]) for name, label in NAMED.items()]
    marks = {"instances": drawings.instances, "runs": drawings.runs, "slots": slots}
    return Part(drawings.name, rows, marks, _gains(found) | gaps)


def _gains(found: Mapping[str, Sequence[Value]]) -> dict[str, Sequence[float]]:
    gains: dict[str, Sequence[float]] = {}
    for name in ("paper", "exact"):
        pairs = [*zip(found["myopic"], found[name], strict=True)]
        shares = [(100 / one.mean, other.difference) for one, other in pairs]
        gains[f"gain, {name}"] = [share * float(d.mean()) for share, d in shares]
        gains[f"error, {name}"] = [share * half_width(d) for share, d in shares]
    return gains


def _on_average(label: str, values: Sequence[Value]) -> Row:
    """Return the mean over instances; shares are those of items by their rank."""
    means = np.array([each.mean for each in values])
    differences = np.array([each.difference.mean() for each in values])
    curves = np.array([each.curve for each in values])
    spread = curves.std(axis=0, ddof=1) / np.sqrt(len(values))
    half = quantile(len(values) - 1) * spread
    ranked = np.mean([np.sort(each.shares)[::-1] for each in values], axis=0)
    return Row(
        group="instances",
        label=label,
        x=None,
        runs=sum(len(each.rewards) for each in values),
        mean=float(means.mean()),
        ci95=half_width(means),
        difference=float(differences.mean()),
        difference_ci95=half_width(differences),
        decision_us=float(np.median([each.decision_us for each in values])),
        shares=ranked.tolist(),
        curve=np.round(curves.mean(axis=0), 6).tolist(),
        curve_ci95=np.round(half, 6).tolist(),
    )


def averaged(trials: Sequence[Sequence[Row]]) -> Sequence[Row]:
    """Return the rows of several trials of the same policies as one."""
    return [_mean_of(rows) for rows in zip(*trials, strict=True)]


def _mean_of(rows: Sequence[Row]) -> Row:
    """Return the mean of rows that differ by their instance alone."""
    means = np.array([row.mean for row in rows])
    differences = np.array([row.difference for row in rows])
    return replace(
        rows[0],
        runs=sum(row.runs for row in rows),
        mean=float(means.mean()),
        ci95=half_width(means),
        difference=float(differences.mean()),
        difference_ci95=half_width(differences),
        decision_us=float(np.median([row.decision_us for row in rows])),
    )
