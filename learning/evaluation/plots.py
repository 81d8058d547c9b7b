"""Plots of an evaluation, fit for a paper and readable without colour."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import as_file, files
from pathlib import Path
from textwrap import wrap

from learning.evaluation.extra import extra
from learning.evaluation.scores import Evaluation, Score

with extra():
    import matplotlib.style as styles
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

STYLE = files("learning.evaluation") / "evaluation.mplstyle"
WIDE = 7.2  # inches: two columns of a paper
ROW, PANEL = 0.2, 1.9  # inches: of a forecaster's line, of its panel
MARGIN = 0.6
ACROSS = 4  # panels
LETTERS = 24  # of a line over a panel
DPI = 160
COLOUR, SHADE = "#0072B2", "#BFBFBF"


def draw(evaluation: Evaluation, folder: Path) -> Iterator[str]:
    """Draw each plot as SVG and PNG; yield their names."""
    for name, drawing in (("log-loss", _log_loss), ("reliability", _reliability)):
        with _styled(), _saved(folder, name) as figure:
            drawing(figure, evaluation)
        yield name


@contextmanager
def _styled() -> Iterator[None]:
    with as_file(STYLE) as file, styles.context(file):
        yield


@contextmanager
def _saved(folder: Path, name: str) -> Iterator[Figure]:
    figure = Figure(dpi=DPI)
    FigureCanvasAgg(figure)
    yield figure
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
    figure.savefig(folder / f"{name}.png", metadata={"Software": None})


def _log_loss(figure: Figure, evaluation: Evaluation) -> None:
    """Draw log losses, and differences to the first, from above down."""
    scores = evaluation.scores
    figure.set_size_inches(WIDE, MARGIN + ROW * len(scores))
    left, right = figure.subplots(1, 2, sharey=True)
    for place, score in enumerate(scores):
        _dot(left, place, score.log_loss, score.log_loss_ci95)
        if place:
            _dot(right, place, score.difference, score.difference_ci95)
    left.set_yticks(range(len(scores)), [score.forecaster for score in scores])
    left.set_ylim(len(scores) - 0.4, -0.6)
    left.set_xlabel("log loss, nats, 95 % interval")
    right.axvline(0, color="black", lw=0.8)
    right.set_xlabel(f"difference to {scores[0].forecaster}, 95 % interval")


def _dot(axes: Axes, place: int, value: float, ends: tuple[float, float]) -> None:
    axes.hlines(place, *ends, color=COLOUR, lw=1.2)
    axes.plot(value, place, "o", color=COLOUR)


def _reliability(figure: Figure, evaluation: Evaluation) -> None:
    """Draw a panel for each forecaster."""
    down = -(-len(evaluation.scores) // ACROSS)
    figure.set_size_inches(WIDE, MARGIN + PANEL * down)
    grid = figure.subplots(down, ACROSS, sharex=True, sharey=True, squeeze=False)
    panels = list(grid.flat)
    for axes, score in zip(panels, evaluation.scores, strict=False):
        _panel(axes, score)
    for axes in panels[len(evaluation.scores) :]:
        axes.remove()
    figure.supxlabel("chance of a like, forecast", size="medium")
    figure.supylabel("share of likes", size="medium")


def _panel(axes: Axes, score: Score) -> None:
    """Draw bins of as many plays each, over how many plays are in bins as wide."""
    wide, bins = score.by_width, score.by_count
    axes.fill_between(
        wide.forecast, wide.plays / wide.plays.max() / 3, color=SHADE, lw=0
    )
    axes.plot([0, 1], [0, 1], color="black", lw=0.6)
    axes.plot(bins.forecast, bins.liked, "o-", color=COLOUR, ms=2.5, lw=1)
    axes.annotate(f"ECE {bins.error:.4f}", (0.05, 0.9))
    axes.set_title("\n".join(wrap(score.forecaster, LETTERS)), loc="left")
    axes.set_aspect("equal")
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
