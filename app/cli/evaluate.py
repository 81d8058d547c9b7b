"""`encore evaluate`: what models foretell of held-out plays, beside what is simpler."""

import json
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress

from app.cli import logs
from app.cli.console import AsJson, Failed, progress, say, show_json, show_table
from app.cli.files import make_folder
from app.cli.session import DatabaseUrl
from app.services.forecasters import forecasters
from learning import Bools, Floats, Plays
from learning.em import Effort
from learning.evaluation import Evaluation, Forecaster, Score, evaluate, table
from learning.fitting import Recipe

COLUMNS = ("forecaster", "log loss", "95 %", "to the first", "95 %", "AUC", "ECE")


def command(
    files: logs.Files = None,
    *,
    user: logs.User = None,
    arm: logs.Arm = None,
    at: logs.Time = None,
    order: logs.Order = None,
    signal: logs.Signal = None,
    fraction: logs.Fraction = None,
    like: logs.Like = None,
    unit: logs.TimeUnit = None,
    spotify: logs.Spotify = None,
    database_url: DatabaseUrl = None,
    share: Annotated[
        float, typer.Option(min=0.05, max=0.95, help="Of each user's plays, to learn.")
    ] = 0.7,
    every: Annotated[
        bool, typer.Option("--all", help="Score first plays of an item, too.")
    ] = False,
    states: Annotated[int, typer.Option(min=2, max=8, help="Of interest.")] = 4,
    types: Annotated[
        int, typer.Option(min=1, max=32, help="Models that items are shared among.")
    ] = 1,
    clock: Annotated[
        bool, typer.Option("--clock", help="Interest rests by time, not by plays.")
    ] = False,
    starts: Annotated[int, typer.Option(min=1, help="Beginnings that are tried.")] = 6,
    steps: Annotated[
        int, typer.Option(min=1, help="E steps from the best, at most.")
    ] = 200,
    seed: Annotated[int, typer.Option(help="Of all random numbers.")] = 0,
    boosting: Annotated[
        bool, typer.Option(help="Try gradient boosting, too; it needs scikit-learn.")
    ] = True,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Folder for table, plots and JSON.", show_default=False
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Score models by what they foretell of the last plays of each user.

    Each play is foretold from all that lies before it; models are learned from the
    first plays of each user alone. Beside them stand rates, moving averages,
    regressions and boosted trees, without and with the user's mood.
    """
    columns = {
        "user": user,
        "arm": arm,
        "time": at,
        "order": order,
        "signal": signal,
        "fraction": fraction,
        "like": like,
    }
    wanted = logs.Wanted(files or (), columns, unit, spotify, database_url)
    effort = Effort(starts=starts, steps=steps, seed=seed)
    recipe = Recipe(states=states, types=types, in_time=clock, effort=effort)
    if out is not None:
        make_folder(out)
    plays = logs.read(wanted)
    found = _scored(plays, recipe, share, every=every, boosting=boosting)
    if out is not None:
        _keep(found, out)
    if as_json:
        show_json(found.plain())
    else:
        _show(found)


def _scored(
    plays: Plays, recipe: Recipe, share: float, *, every: bool, boosting: bool
) -> Evaluation:
    with ThreadPoolExecutor(os.cpu_count()) as pool, progress() as bar:
        wanted = forecasters(recipe, pool.map, boosted=boosting)
        try:
            return evaluate(plays, _told(bar, wanted), share, repeats=not every)
        except ModuleNotFoundError as error:
            raise Failed(
                f"{error.name} is missing: pip install '.[learn]' in a clone, or leave"
                " it out: --no-boosting."
            ) from error
        except ValueError as error:
            raise Failed(f"{error}.") from error


def _told(bar: Progress, wanted: Mapping[str, Forecaster]) -> Mapping[str, Forecaster]:
    """The same, of which each tells when it is done."""
    task = bar.add_task("forecasters", total=len(wanted))

    def told(forecaster: Forecaster) -> Callable[[Plays, Bools], Floats]:
        def forecast(plays: Plays, train: Bools) -> Floats:
            found = forecaster(plays, train)
            bar.advance(task)
            return found

        return forecast

    return {name: told(forecaster) for name, forecaster in wanted.items()}


def _keep(found: Evaluation, out: Path) -> None:
    try:
        from learning.evaluation.plots import draw  # noqa: PLC0415 - of an extra
    except ModuleNotFoundError as error:
        message = f"{error.name} is missing: pip install '.[learn]' in a clone."
        raise Failed(message) from error
    (out / "evaluation.json").write_text(json.dumps(found.plain(), indent=1) + "\n")
    (out / "evaluation.md").write_text(table(found))
    for _ in draw(found, out):
        pass


def _show(found: Evaluation) -> None:
    show_table(COLUMNS, [_cells(score) for score in found.scores])
    kind = "of items played before" if found.repeats else "of any items"
    say()
    say(
        f"{int(found.plays.sum())} plays {kind}, the last"
        f" {1 - found.share:.0%} of each of {len(found.users)} users. Log loss in nats:"
        " the lower the better. Intervals by resampling users."
    )


def _cells(score: Score) -> tuple[str, ...]:
    low, high = score.log_loss_ci95
    below, above = score.difference_ci95
    return (
        score.forecaster,
        f"{score.log_loss:.4f}",
        f"{low:.4f} to {high:.4f}",
        f"{score.difference:+.4f}",
        f"{below:+.4f} to {above:+.4f}",
        f"{score.auc:.3f}",
        f"{score.by_count.error:.3f}",
    )
