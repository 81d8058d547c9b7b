"""`encore fit`: models learned from a log of plays."""

import json
import os
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app import __version__
from app.cli import logs
from app.cli.console import AsJson, Failed, note, say, show_json, show_table
from app.cli.files import make_folder
from app.cli.session import DatabaseUrl
from app.services import candidates, fits
from app.services.fits import Naming
from learning import NONE, Floats, Plays
from learning.chain import Chain
from learning.em import Effort, Learned
from learning.evaluation import Score
from learning.fitting import Fitted, Recipe, fit, moods_of
from learning.held_out import Split, latest_apart
from learning.identification import Identification, identify
from learning.resampling import Intervals, intervals
from learning.streams import streams

SLOT_S = 240.0  # about a song


@dataclass(frozen=True, slots=True)
class Found:
    """What was learned, and how sure it is.

    judged: scores of the plays that were held out, by forecaster; empty: there are none
    """

    plays: Plays
    split: Split
    fitted: Fitted
    identified: Identification
    spread: Intervals | None
    judged: Sequence[Score]
    seconds: float


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
    states: Annotated[int, typer.Option(min=2, max=8, help="Of interest.")] = 4,
    types: Annotated[
        int, typer.Option(min=1, max=32, help="Models that items are shared among.")
    ] = 1,
    clock: Annotated[
        bool, typer.Option("--clock", help="Interest rests by time, not by plays.")
    ] = False,
    mood: Annotated[
        bool, typer.Option("--mood", help="Likes also depend on the last answers.")
    ] = False,
    slot_s: Annotated[
        float, typer.Option(min=1.0, help="With --clock: seconds of a slot.")
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
    make_folder(out)
    plays = logs.read(wanted)
    recipe = Recipe(
        states=states,
        types=types,
        mood=fits.usual_mood(plays) if mood else None,
        in_time=clock,
        effort=effort,
    )
    found = _found(plays, latest_apart(plays, held_out), recipe, draws)
    source = f"encore fit {__version__}, {len(plays)} plays"
    naming = Naming(name, source, slot_s)
    models = fits.model_lines(found.fitted, plays, naming)
    fits.write(out, candidates.MODELS, models)
    fits.write(out, candidates.ITEMS, fits.item_lines(found.fitted, plays, naming))
    report = {**_report(found), "digest": candidates.digest_of(out)}
    fits.write(out, candidates.REPORT, iter([json.dumps(report, indent=1)]))
    if as_json:
        show_json(report)
    else:
        _show(found, out)


def _found(plays: Plays, split: Split, recipe: Recipe, draws: int) -> Found:
    """Learn, on all processors."""
    began = time.perf_counter()
    learned = plays.of(split.learned)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            fitted = fit(learned, recipe, pool.map)
        except ValueError as error:
            raise Failed(f"{error}.") from error
        mood = moods_of(learned, recipe.mood)
        seen = streams(learned, mood, in_time=recipe.in_time)
        identified = identify(seen, fitted.whole, recipe.smoothing, pool.map)
        spread = None
        if draws:
            reward = np.array(plays.reward)
            seed = recipe.effort.seed
            spread = intervals(
                seen,
                fitted.whole,
                reward,
                recipe.smoothing,
                draws=draws,
                seed=seed,
                spread=pool.map,
            )
        plain = None
        if recipe.mood is not None:
            plain = fit(learned, replace(recipe, mood=None), pool.map)
    judged = fits.judged(plays, split.learned, fitted, plain)
    seconds = time.perf_counter() - began
    return Found(plays, split, fitted, identified, spread, judged, seconds)


def _report(found: Found) -> Mapping[str, object]:
    plays, types, whole = found.plays, found.fitted.types, found.fitted.whole
    kinds = np.bincount(types.of_arms, minlength=len(types.chains))
    recipe = found.fitted.recipe
    return {
        "encore": __version__,
        "made_at": datetime.now(UTC).isoformat(),
        "learned_until": candidates.moment(found.split.until),
        "plays": len(plays),
        "learned": int(found.split.learned.sum()),
        "answered": int((plays.answer != NONE).sum()),
        "users": len(plays.users),
        "items": len(plays.arms),
        "states": recipe.states,
        "clock": recipe.in_time,
        "mood": None if recipe.mood is None else asdict(recipe.mood),
        "items_by_model": kinds.tolist(),
        "likelihood": whole.counts.likelihood,
        "steps": len(whole.risen),
        "settled": whole.settled and types.settled,
        "others": list(whole.others),
        "identification": _identification(found.identified),
        "intervals": None if found.spread is None else _intervals(found.spread),
        "held_out": {score.forecaster: score.summary() for score in found.judged},
        "seconds": round(found.seconds, 3),
    }


def _identification(found: Identification) -> Mapping[str, object]:
    return {
        "states_told_apart": found.states,
        "window": found.window,
        "singular_values": list(found.singular_values),
        "errors": list(found.errors),
        "bonds": [asdict(told) | {"sure": told.sure} for told in found.told],
        "warnings": list(found.warnings),
    }


def _intervals(spread: Intervals) -> Mapping[str, object]:
    names = ("play", "rest", "observe", "prior")
    return {
        name: [getattr(end, name).tolist() for end in (spread.low, spread.high)]
        for name in names
    }


def _show(found: Found, out: Path) -> None:
    types, whole = found.fitted.types, found.fitted.whole
    reward, shares = np.array(found.plays.reward), found.fitted.shares
    kinds = np.bincount(types.of_arms, minlength=len(types.chains)).tolist()
    rows = [
        (str(number), str(kinds[number - 1]), _numbers(_mean(shares, chain) @ reward),
         _numbers(np.diagonal(chain.play)), _numbers(chain.prior))
        for number, chain in enumerate(types.chains, 1)
    ]  # fmt: skip
    columns = ("model", "items", "reward by state", "stays by a play", "prior")
    show_table(columns, rows)
    say()
    say(_told(whole, found))
    if found.judged:
        say(_compared(found))
    for warning in (*found.identified.warnings, *_unsettled(found)):
        note(f"Warning: {warning}")
    say(f"{out}/models.ndjson, {out}/items.ndjson, {out}/report.json")


def _mean(shares: Floats, chain: Chain) -> Floats:
    """(S, K) chances of signals in the mean mood."""
    mean: Floats = np.tensordot(shares, chain.observe, 1)
    return mean


def _told(whole: Learned, found: Found) -> str:
    learned = found.plays.of(found.split.learned)
    per_answer = -whole.counts.likelihood / max((learned.answer != NONE).sum(), 1)
    return (
        f"{len(learned)} plays of {len(np.unique(learned.user))} users: log loss"
        f" {per_answer:.4f} on what it was learned from, after {len(whole.risen)} steps"
        f" and {found.seconds:.0f} s. The log tells {found.identified.states} states"
        " apart."
    )


def _compared(found: Found) -> str:
    held = len(found.plays) - int(found.split.learned.sum())
    losses = ", ".join(
        f"{score.forecaster} {score.log_loss:.4f}" for score in found.judged
    )
    return f"Log loss on the {held} plays that were held out: {losses}."


def _unsettled(found: Found) -> Sequence[str]:
    if found.fitted.whole.settled and found.fitted.types.settled:
        return ()
    return ("It had not settled: give it more --steps.",)


def _numbers(values: "np.typing.NDArray[np.float64]") -> str:
    return " ".join(f"{value:.2f}" for value in values)
