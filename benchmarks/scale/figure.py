"""Costs against what grows, as a picture."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from benchmarks.scale.costs import Cost

AXES = {"users": "users", "played": "items played", "items": "items in the catalogue"}
NAMES = {"sqlite": "SQLite", "postgresql": "PostgreSQL"}
SIZE = (10, 3.2)


def draw(found: Sequence[tuple[str, str, int, Cost]], file: Path) -> None:
    """Draw processor time a request, by database, against each thing that grows."""
    figure = Figure(SIZE, layout="constrained")
    FigureCanvasSVG(figure)
    for plot, (axis, label) in zip(
        figure.subplots(1, len(AXES), sharey=True), AXES.items(), strict=True
    ):
        for kind in dict.fromkeys(kind for kind, *_ in found):
            costs = {
                n: cost.cpu_us for k, a, n, cost in found if (k, a) == (kind, axis)
            }
            plot.plot([*costs], [*costs.values()], marker="o", label=NAMES[kind])
        plot.set(xscale="log", xlabel=label)
    figure.axes[0].set(ylabel="processor time a request, µs", ylim=(0, None))
    figure.axes[0].legend()
    figure.savefig(file, metadata={"Date": None})
