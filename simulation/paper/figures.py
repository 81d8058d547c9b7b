"""Figures fit for a paper: one style, readable without colour.

Colours are those of Okabe and Ito (2008), which differ for the colour-blind, too, and
greys for what others are measured by; each line has its own dashes and marks, each bar
its own hatching.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import matplotlib.style as styles
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from simulation.paper.instances import NAMED
from simulation.paper.labels import (
    EXACT,
    EXPECTED,
    FIXED,
    MYOPIC,
    PAPER,
    RANDOM,
    RANDOM_BASE,
    ROUND_ROBIN,
    SHIPPED,
    WHITTLE,
    WHITTLE_MC,
)
from simulation.paper.parts import BELIEF, CUTS, STATE
from simulation.paper.rows import Part, Row

WIDE, HIGH = 7.2, 2.7  # inches: two columns of a paper
DPI = 160
REWARD = "discounted likes"
STARTS = {BELIEF: "start as believed", STATE: "start in the paper's states"}
PAPERS_GAIN = 8.0  # percent
INTERVALS: Mapping[str, str] = MappingProxyType(
    {"mean": "ci95", "difference": "difference_ci95"}
)
EACH = 3  # slots of a curve between two points of its line
MARKED = 12  # points of a line between two marks


class Look(NamedTuple):
    """How a policy is drawn. `dashes`: of its line; `hatch`: of its bars."""

    colour: str
    dashes: str | tuple[float, tuple[float, ...]]
    marker: str
    hatch: str


LOOKS: Mapping[str, Look] = MappingProxyType(
    {
        MYOPIC: Look("#0072B2", "-", "o", ""),
        PAPER: Look("#D55E00", "--", "s", "////"),
        EXPECTED: Look("#E69F00", "-.", "^", "\\\\\\\\"),
        EXACT: Look("#009E73", ":", "D", "...."),
        SHIPPED: Look("#000000", (0, (5, 1, 1, 1, 1, 1)), "*", "xxxx"),
        WHITTLE: Look("#CC79A7", (0, (7, 2)), "v", "----"),
        WHITTLE_MC: Look("#56B4E9", (0, (3, 1, 1, 1)), "P", "++++"),
        FIXED: Look("#7F7F7F", (0, (1, 3)), "X", "oo"),
        RANDOM: Look("#BFBFBF", (0, (4, 4)), "<", ""),
        RANDOM_BASE: Look("#666666", (0, (2, 1)), "p", "||||"),
        ROUND_ROBIN: Look("#666666", (0, (6, 1, 1, 1)), ">", "**"),
    }
)
OF_EXAMPLES: Mapping[str, Look] = MappingProxyType(
    {
        "example 1": Look("#000000", "-", "o", ""),
        "example 2": Look("#0072B2", "--", "s", ""),
        "example 3": Look("#D55E00", ":", "D", ""),
    }
)
STYLE = files("simulation.paper") / "paper.mplstyle"


def draw(parts: Mapping[str, Part], folder: Path) -> Iterator[str]:
    """Draw every figure as SVG and PNG; yield their names."""
    for name, drawing in DRAWINGS.items():
        with _styled(), _saved(folder, name) as figure:
            drawing(figure, parts)
        yield name


@contextmanager
def _styled() -> Iterator[None]:
    with as_file(STYLE) as file, styles.context(file):
        yield


@contextmanager
def _saved(folder: Path, name: str) -> Iterator[Figure]:
    figure = Figure(figsize=(WIDE, HIGH), dpi=DPI)
    FigureCanvasAgg(figure)
    yield figure
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
    figure.savefig(folder / f"{name}.png", metadata={"Software": None})


def _example(figure: Figure, part: Part) -> None:
    figure.set_size_inches(WIDE, 2 * HIGH)
    grid = figure.subplots(2, 3, width_ratios=(1.1, 1.2, 1))
    for line, (group, told) in zip(grid, STARTS.items(), strict=True):
        rows = part.group(group)
        _curves(line[0], rows)
        line[0].set_title(told, loc="left")
        _rewards(line[1], rows, part.marks if group == BELIEF else {})
        _shares(line[2], rows)
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)


def _curves(axes: Axes, rows: Sequence[Row]) -> None:
    """Draw what was earned by the end of each slot."""
    for place, row in enumerate(rows):
        look, shown = LOOKS[row.label], slice(None, None, EACH)
        slots = np.arange(1, len(row.curve) + 1)[shown]
        curve, half = np.array(row.curve)[shown], np.array(row.curve_ci95)[shown]
        axes.plot(
            slots,
            curve,
            label=row.label,
            color=look.colour,
            linestyle=look.dashes,
            marker=look.marker,
            markersize=3,
            markevery=(place, MARKED),
        )
        axes.fill_between(
            slots, curve - half, curve + half, color=look.colour, alpha=0.25, lw=0
        )
    axes.set_xlabel("slot")
    axes.set_ylabel(f"cumulative {REWARD}")


def _rewards(axes: Axes, rows: Sequence[Row], marks: Mapping[str, float]) -> None:
    """Draw what was earned in all, with intervals, from below up."""
    shown = [row for row in rows if row.label != RANDOM]
    for place, row in enumerate(reversed(shown)):
        look = LOOKS[row.label]
        axes.errorbar(
            row.mean,
            place,
            xerr=row.ci95,
            color=look.colour,
            marker=look.marker,
            capsize=2,
            linestyle="none",
        )
    for name, dashes in (("optimum", "-"), ("bound", ":")):
        if name in marks:
            axes.axvline(marks[name], color="black", linestyle=dashes, lw=0.8)
            at = (marks[name], 1.0)
            within = ("data", "axes fraction")
            axes.annotate(name, at, xycoords=within, ha="right", va="bottom")
            break
    axes.set_yticks(range(len(shown)), [row.label for row in reversed(shown)])
    axes.set_ylim(-0.6, len(shown) - 0.4)
    axes.set_xlabel(f"{REWARD}, 95 % interval")


def _shares(axes: Axes, rows: Sequence[Row]) -> None:
    """Draw how often each item was played."""
    shown = [row for row in rows if row.label not in {RANDOM, FIXED}]
    width = 0.8 / len(shown)
    for place, row in enumerate(shown):
        look = LOOKS[row.label]
        left = np.arange(1, len(row.shares) + 1) - 0.4 + width * (place + 0.5)
        axes.bar(
            left,
            100 * np.array(row.shares),
            width,
            color=look.colour,
            hatch=look.hatch,
            edgecolor="white",
            linewidth=0.3,
        )
    axes.set_xticks(range(1, len(shown[0].shares) + 1))
    axes.set_xlabel("item")
    axes.set_ylabel("share of plays, %")
    axes.grid(visible=False, axis="x")


def _line(
    axes: Axes, rows: Sequence[Row], label: str, what: str, look: Look | None = None
) -> None:
    """Draw a field of rows along x, with its interval if it has one."""
    look = look or LOOKS[label]
    x, y = _across(rows), np.array([getattr(row, what) for row in rows])
    axes.plot(
        x,
        y,
        color=look.colour,
        linestyle=look.dashes,
        marker=look.marker,
        label=label,
    )
    if what in INTERVALS:
        half = np.array([getattr(row, INTERVALS[what]) for row in rows])
        axes.fill_between(x, y - half, y + half, color=look.colour, alpha=0.25, lw=0)


def _across(rows: Sequence[Row]) -> Sequence[float]:
    """Return where rows stand on their line."""
    return [row.x for row in rows if row.x is not None]


def _noise(figure: Figure, parts: Mapping[str, Part]) -> None:
    part = parts["noise"]
    axes = figure.subplots()
    for group, label in (("clicks", PAPER), ("expected", EXPECTED)):
        _line(axes, part.group(group), label, "difference")
    exact = part.row("exact", EXACT)
    look = LOOKS[EXACT]
    axes.axhline(
        exact.difference, color=look.colour, linestyle=look.dashes, label=EXACT
    )
    axes.axhline(0, color=LOOKS[MYOPIC].colour, lw=1, label=MYOPIC)
    axes.axvline(100, color="black", lw=0.6, linestyle=(0, (2, 2)))
    axes.annotate("the paper's L", (100, 0.03), xycoords=("data", "axes fraction"))
    axes.set_xscale("log")
    axes.set_xlabel("trajectories L")
    axes.set_ylabel(f"{REWARD} above myopic")
    axes.legend()


def _truncation(figure: Figure, parts: Mapping[str, Part]) -> None:
    example, part = parts["example-3"], parts["truncation"]
    both = figure.subplots(1, 2)
    for axes, (group, told) in zip(both, STARTS.items(), strict=True):
        _line(axes, part.group(group), WHITTLE_MC, "mean")
        for label in (WHITTLE, PAPER, MYOPIC):
            row, look = example.row(group, label), LOOKS[label]
            axes.axhline(
                row.mean, color=look.colour, linestyle=look.dashes, label=label
            )
        if group == BELIEF:
            axes.axhline(example.marks["optimum"], color="black", lw=0.8)
            axes.annotate(
                f"optimum {example.marks['optimum']:.4f}",
                (1.0, example.marks["optimum"]),
                xycoords=("axes fraction", "data"),
                ha="right",
                va="bottom",
            )
        axes.set_title(told, loc="left")
        axes.set_xticks(CUTS)
        axes.set_xlabel("horizon of the Monte Carlo index, slots")
        axes.set_ylabel(REWARD)
    both[0].legend(loc="center right")


def _instances(figure: Figure, part: Part) -> None:
    """Draw what instances have on average, and how they differ."""
    series = part.series
    figure.set_size_inches(WIDE, 2 * HIGH)
    above, (left, right) = figure.subplots(2, 2)
    _curves(above[0], part.rows)
    above[0].set_title("mean over instances", loc="left")
    above[0].legend()
    _shares(above[1], part.rows)
    above[1].set_xlabel("item, from the most played of an instance on")
    _spread(left, series, "gain", {"paper": PAPER, "exact": EXACT})
    left.axvline(0, color=LOOKS[MYOPIC].colour, lw=1)
    if part.name == "example-4":
        left.axvline(PAPERS_GAIN, color="black", lw=0.8, linestyle=(0, (2, 2)))
        left.annotate(
            "the paper's 8 % ",
            (PAPERS_GAIN, 0.5),
            xycoords=("data", "axes fraction"),
            ha="right",
        )
    left.set_xlabel("gain over myopic, %")
    _spread(right, series, "gap", NAMED)
    right.set_xlabel("gap to the upper bound, %")


def _spread(
    axes: Axes,
    series: Mapping[str, Sequence[float]],
    what: str,
    labels: Mapping[str, str],
) -> None:
    """Draw the share of instances with at most that."""
    for name, label in labels.items():
        look = LOOKS[label]
        axes.ecdf(
            series[f"{what}, {name}"],
            color=look.colour,
            linestyle=look.dashes,
            label=label,
        )
    axes.yaxis.set_major_formatter(PercentFormatter(1))
    axes.set_ylabel("instances with at most that")


def _items(figure: Figure, parts: Mapping[str, Part]) -> None:
    part = parts["items"]
    left, right = figure.subplots(1, 2)
    for label in dict.fromkeys(row.label for row in part.rows):
        rows = [row for row in part.rows if row.label == label]
        if label != MYOPIC:
            _line(left, rows, label, "difference")
        _line(right, rows, label, "decision_us")
    left.axhline(0, color=LOOKS[MYOPIC].colour, lw=1, label=MYOPIC)
    left.set_ylabel(f"{REWARD} above myopic")
    right.set_ylabel("time of a decision, µs")
    right.set_yscale("log")
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_xlabel("items N")
    left.legend()


def _horizon(figure: Figure, parts: Mapping[str, Part]) -> None:
    part = parts["horizon"]
    left, right = figure.subplots(1, 2)
    for group, look in OF_EXAMPLES.items():
        _line(left, part.group(group), group, "difference", look)
        _line(right, part.group(group), group, "decision_us", look)
    left.set_ylabel(f"{REWARD} above myopic")
    right.set_ylabel("time of a decision, µs")
    right.set_yscale("log")
    for axes in (left, right):
        axes.set_xticks(range(1, 11))
        axes.set_xlabel("horizon H of exact rollout, plays")
    left.legend()


def _robustness(figure: Figure, parts: Mapping[str, Part]) -> None:
    part = parts["robustness"]
    axes = figure.subplots()
    for label in dict.fromkeys(row.label for row in part.rows):
        rows = [
            replace(row, x=100 * (row.x or 0.0))
            for row in part.rows
            if row.label == label
        ]
        _line(axes, rows, label, "mean")
    axes.set_xlabel("share of the parameters that is wrong, %")
    axes.set_ylabel(REWARD)
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))


DRAWINGS = MappingProxyType(
    {
        "example-1": lambda figure, parts: _example(figure, parts["example-1"]),
        "noise": _noise,
        "structure": lambda figure, parts: _instances(figure, parts["structure"]),
        "example-2": lambda figure, parts: _example(figure, parts["example-2"]),
        "example-3": lambda figure, parts: _example(figure, parts["example-3"]),
        "truncation": _truncation,
        "example-4": lambda figure, parts: _instances(figure, parts["example-4"]),
        "items": _items,
        "horizon": _horizon,
        "robustness": _robustness,
    }
)
