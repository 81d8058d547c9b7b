"""`encore fit`: models learned from a log of plays."""

import json
from pathlib import Path
from typing import Annotated

import typer

from app import __version__
from app.cli import fit_report, logs
from app.cli.console import AsJson, say, show_json
from app.cli.files import make_folder
from app.cli.fitting import Asked, learned
from app.cli.session import DatabaseUrl
from app.cli.sizes import AUTO, sizes
from app.cli.spreads import Scheduler, spreading
from app.services import candidates, fits
from app.services.clocks import LONGEST, SHORTEST
from app.services.fits import Naming
from learning.em import Effort
from learning.fitting import Recipe
from learning.held_out import latest_apart

USUAL_STATES = (2, 3, 4)
USUAL_TYPES = (1, 2, 3, 4, 6, 8)
SLOT_S = 240.0  # about a song
MOST_SAMPLES = 32


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
    samples: Annotated[
        int,
        typer.Option(
            min=0,
            max=MOST_SAMPLES,
            help="Of each model, drawn from what the log leaves open: for `thompson`.",
        ),
    ] = 0,
    sweeps: Annotated[
        int, typer.Option(min=0, help="Over the log, for each sample.")
    ] = 50,
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
        samples,
        sweeps,
        mood,
        stay=not files and items is None,
    )
    asked.check()
    make_folder(out)
    with spreading(scheduler) as spread:
        plays = logs.read(wanted)
        described = logs.items(wanted, items)
        split = latest_apart(plays, held_out)
        found = learned(plays, split, described, asked, spread)
    source = f"encore fit {__version__}, {len(plays)} plays"
    source += f", slots of {slot_s:g} s" if clock else ""
    naming = Naming(name, source, slot_s)
    models = fits.model_lines(found.fitted, plays, naming, found.drawn)
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
