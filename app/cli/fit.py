"""`encore fit`: models learned from a log of plays."""

import json
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, TypeAlias

import numpy as np
import typer

from app import __version__
from app.cli import fit_report, logs
from app.cli.console import AsJson, Failed, progress, show_json
from app.cli.files import make_folder
from app.cli.fit_report import Found
from app.cli.session import DatabaseUrl
from app.cli.sizes import AUTO, sizes
from app.cli.spreads import Scheduler, spreading
from app.services import fits
from app.services.fits import Naming
from app.services.items import NewItem
from learning import Plays
from learning.em import Effort, Spread
from learning.fitting import Recipe, fit
from learning.identification import identify
from learning.resampling import intervals
from learning.selection import Selection, select
from learning.streams import streams

Sizes: TypeAlias = tuple[Sequence[int], Sequence[int]]

USUAL_STATES = (2, 3, 4)
USUAL_TYPES = (1, 2, 3, 4, 6, 8)
SLOT_S = 240.0  # about a song


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
    out: Annotated[Path, typer.Option("--out", help="Folder to write to.")] = Path(
        "fitted"
    ),
    items: Annotated[
        Path | None,
        typer.Option(
            "--items",
            help="Items with their tags, as `import items` reads them: new ones take"
            " after others. Left out: those of the database, or of the log.",
            show_default=False,
        ),
    ] = None,
    states: Annotated[
        str,
        typer.Option(
            help="Of interest: 4; or to choose from, 2,3,4 or 2-4; auto: 2-4."
        ),
    ] = AUTO,
    types: Annotated[
        str,
        typer.Option(
            help="Models that items are shared among, the same; auto: 1-4,6,8."
        ),
    ] = "1",
    clock: Annotated[
        bool, typer.Option("--clock", help="Interest rests by time, not by plays.")
    ] = False,
    slot_s: Annotated[
        float, typer.Option(min=1.0, help="With --clock: seconds of a slot.")
    ] = SLOT_S,
    starts: Annotated[int, typer.Option(min=1, help="Beginnings that are tried.")] = 6,
    steps: Annotated[
        int, typer.Option(min=1, help="E steps from the best, at most.")
    ] = 200,
    draws: Annotated[
        int, typer.Option(min=0, help="Users drawn anew so often, for intervals.")
    ] = 0,
    seed: Annotated[int, typer.Option(help="Of all random numbers.")] = 0,
    name: Annotated[str, typer.Option(help="What the models are called.")] = "learned",
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Learn models from a log of plays, and write them as imports read them.

    In the folder: models.ndjson, items.ndjson (which item follows which model), and
    report.json. Nothing goes live by this.
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
    recipe = Recipe(in_time=clock, effort=effort)
    choice = (
        sizes("--states", states, USUAL_STATES, 2, 8),
        sizes("--types", types, USUAL_TYPES, 1, 32),
    )
    make_folder(out)
    with spreading(scheduler) as spread:
        plays = logs.read(wanted)
        described = logs.items(wanted, items)
        found = _found(plays, described, recipe, choice, draws, spread)
    source = f"encore fit {__version__}, {len(plays)} plays"
    naming = Naming(name, source, slot_s)
    fits.write(out, "models.ndjson", fits.model_lines(found.fitted, plays, naming))
    fits.write(out, "items.ndjson", fits.item_lines(found.fitted, found.placed, naming))
    report = fit_report.report(found)
    fits.write(out, "report.json", iter([json.dumps(report, indent=1)]))
    if as_json:
        show_json(report)
    else:
        fit_report.show(found, out)


def _selected(
    plays: Plays, recipe: Recipe, wanted: Sizes, spread: Spread
) -> Selection | None:
    """Numbers of states and types, where there is a choice."""
    states, types = wanted
    if len(states) == len(types) == 1:
        return None
    with progress() as bar:
        task = bar.add_task("sizes", total=len(states) + len(types) - 1)
        return select(plays, recipe, states, types, spread, partial(bar.advance, task))


def _found(
    plays: Plays,
    items: Sequence[NewItem] | None,
    recipe: Recipe,
    wanted: Sizes,
    draws: int,
    spread: Spread,
) -> Found:
    began = time.perf_counter()
    states, types = (each[0] for each in wanted)
    try:
        selection = _selected(plays, recipe, wanted, spread)
        if selection is not None:
            states, types = selection.states, selection.types
        recipe = replace(recipe, states=states, types=types)
        fitted = fit(plays, recipe, spread)
    except ValueError as error:
        raise Failed(f"{error}.") from error
    seen = streams(plays, in_time=recipe.in_time)
    identified = identify(seen, fitted.whole, recipe.smoothing, spread)
    sure = None
    if draws:
        reward, seed = np.array(plays.reward), recipe.effort.seed
        resample = partial(intervals, seen, fitted.whole, reward, recipe.smoothing)
        sure = resample(draws=draws, seed=seed, spread=spread)
    placed, took = fits.place(fitted, plays, items), time.perf_counter() - began
    return Found(plays, selection, fitted, placed, identified, sure, took)
