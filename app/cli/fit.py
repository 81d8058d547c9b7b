"""`encore fit`: models learned from a log of plays."""

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app import __version__
from app.cli import fit_report, logs
from app.cli.console import AsJson, Failed, progress, say, show_json
from app.cli.files import make_folder
from app.cli.fit_report import Found
from app.cli.session import DatabaseUrl
from app.cli.sizes import AUTO, sizes
from app.cli.spreads import Scheduler, spreading
from app.services import candidates, fits
from app.services.clocks import LONGEST, SHORTEST
from app.services.fits import Naming
from app.services.items import NewItem
from learning import Plays
from learning.em import Effort, Spread
from learning.fitting import Recipe, fit, moods_of
from learning.held_out import Split, latest_apart
from learning.identification import identify
from learning.resampling import intervals
from learning.selection import Selection, select
from learning.streams import streams

USUAL_STATES = (2, 3, 4)
USUAL_TYPES = (1, 2, 3, 4, 6, 8)
SLOT_S = 240.0  # about a song


@dataclass(frozen=True, slots=True)
class Asked:
    """How models are learned.

    recipe: but for numbers of states and types
    states: to choose from
    types:  to choose from
    draws:  of users, for intervals
    mood:   whether likes also depend on the last answers
    stay:   items that nothing is told of stay with the models they have
    """

    recipe: Recipe
    states: Sequence[int]
    types: Sequence[int]
    draws: int
    mood: bool
    stay: bool


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
    mood: Annotated[
        bool, typer.Option("--mood", help="Likes also depend on the last answers.")
    ] = False,
    slot_s: Annotated[
        float,
        typer.Option(
            min=SHORTEST, max=LONGEST, help="With --clock: seconds of a slot."
        ),
    ] = SLOT_S,
    held_out: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=0.9,
            help="Share of plays, the latest, that are judged by.",
        ),
    ] = 0.2,
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
    asked = Asked(
        Recipe(in_time=clock, effort=effort),
        sizes("--states", states, USUAL_STATES, 2, 8),
        sizes("--types", types, USUAL_TYPES, 1, 32),
        draws,
        mood,
        stay=not files and items is None,
    )
    make_folder(out)
    with spreading(scheduler) as spread:
        plays = logs.read(wanted)
        described = logs.items(wanted, items)
        split = latest_apart(plays, held_out)
        found = _found(plays, split, described, asked, spread)
    source = f"encore fit {__version__}, {len(plays)} plays"
    source += f", slots of {slot_s:g} s" if clock else ""
    naming = Naming(name, source, slot_s)
    models = fits.model_lines(found.fitted, plays, naming)
    fits.write(out, candidates.MODELS, models)
    follows = fits.item_lines(found.fitted, found.placed, naming)
    fits.write(out, candidates.ITEMS, follows)
    report = {
        **fit_report.report(found),
        "slot_s": slot_s if clock else None,
        "digest": candidates.digest_of(out),
    }
    fits.write(out, candidates.REPORT, iter([json.dumps(report, indent=1)]))
    if as_json:
        show_json(report)
    else:
        fit_report.show(found, out)
        if clock:
            say(f'They go with the clock: PUT /v1/admin/clock {{"slot_s": {slot_s:g}}}')


def _found(
    plays: Plays,
    split: Split,
    items: Sequence[NewItem] | None,
    asked: Asked,
    spread: Spread,
) -> Found:
    began = time.perf_counter()
    learned, plain = plays.of(split.learned), None
    if asked.mood:
        moody = replace(asked.recipe, mood=fits.usual_mood(plays))
        asked = replace(asked, recipe=moody)
    try:
        recipe, selection = _sized(learned, asked, spread)
        fitted = fit(learned, recipe, spread)
        if asked.mood:
            plain = fit(learned, replace(recipe, mood=None), spread)
    except ValueError as error:
        raise Failed(f"{error}.") from error
    mood = moods_of(learned, recipe.mood)
    seen = streams(learned, mood, in_time=recipe.in_time)
    identified = identify(seen, fitted.whole, recipe.smoothing, spread)
    sure = None
    if asked.draws:
        reward, seed = np.array(plays.reward), recipe.effort.seed
        resample = partial(intervals, seen, fitted.whole, reward, recipe.smoothing)
        sure = resample(draws=asked.draws, seed=seed, spread=spread)
    placed = fits.place(fitted, learned, items, stay=asked.stay)
    judged = fits.judged(plays, split.learned, fitted, placed, plain)
    took = time.perf_counter() - began
    return Found(
        plays, split, selection, fitted, placed, identified, sure, judged, took
    )


def _sized(
    plays: Plays, asked: Asked, spread: Spread
) -> tuple[Recipe, Selection | None]:
    """How to learn, with numbers that were chosen where there is a choice."""
    states, types = asked.states, asked.types
    recipe = replace(asked.recipe, states=states[0], types=types[0])
    if len(states) == len(types) == 1:
        return recipe, None
    with progress() as bar:
        task = bar.add_task("sizes", total=len(states) + len(types) - 1)
        tell = partial(bar.advance, task)
        found = select(plays, recipe, states, types, spread, tell)
    return replace(recipe, states=found.states, types=found.types), found
