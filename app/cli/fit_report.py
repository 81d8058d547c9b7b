"""What `encore fit` found, for people and for programs."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np

from app import __version__
from app.cli.console import note, say, show_table
from app.services import candidates
from app.services.fits import Placed
from learning import NONE, Floats, Plays
from learning.chain import Chain
from learning.em import Learned
from learning.evaluation import Score
from learning.fitting import Fitted
from learning.held_out import Split
from learning.identification import Identification
from learning.posterior import Posterior
from learning.resampling import Intervals
from learning.selection import Selection, Tried


@dataclass(frozen=True, slots=True)
class Found:
    """What was learned, and how sure it is.

    drawn:  what each model may be as well as not; empty: nobody asked
    judged: scores of the plays that were held out, by forecaster; empty: there are none
    """

    plays: Plays
    split: Split
    selection: Selection | None
    fitted: Fitted
    drawn: Sequence[Posterior]
    placed: Placed
    identified: Identification
    sure: Intervals | None
    judged: Sequence[Score]
    seconds: float

    @property
    def items(self) -> Sequence[int]:
        """How many follow each model."""
        numbers = [number for _, number in self.placed.follows]
        return [numbers.count(k) for k in range(len(self.fitted.types.chains))]


def report(found: Found) -> Mapping[str, object]:
    """All of it, as JSON can hold it."""
    plays, types, whole = found.plays, found.fitted.types, found.fitted.whole
    recipe = found.fitted.recipe
    return {
        "encore": __version__,
        "made_at": datetime.now(UTC).isoformat(),
        "learned_until": candidates.moment(found.split.until),
        "plays": len(plays),
        "learned": int(found.split.learned.sum()),
        "answered": int((plays.answer != NONE).sum()),
        "users": len(plays.users),
        "items": len(found.placed.items),
        "states": recipe.states,
        "types": recipe.types,
        "selection": None if found.selection is None else asdict(found.selection),
        "clock": recipe.in_time,
        "mood": None if recipe.mood is None else asdict(recipe.mood),
        "items_by_model": found.items,
        "items_by_reason": found.placed.counts,
        "likelihood": whole.counts.likelihood,
        "steps": len(whole.risen),
        "settled": whole.settled and types.settled,
        "others": list(whole.others),
        "identification": _identification(found.identified),
        "intervals": None if found.sure is None else _intervals(found.sure),
        "samples": [
            {
                "kept": len(each.chains),
                "remembered": round(each.remembered(np.array(plays.reward)), 3),
            }
            for each in found.drawn
        ],
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


def _intervals(sure: Intervals) -> Mapping[str, object]:
    names = ("play", "rest", "observe", "prior")
    return {
        name: [getattr(end, name).tolist() for end in (sure.low, sure.high)]
        for name in names
    }


def show(found: Found, out: Path) -> None:
    """Print tables, warnings, and where the files are."""
    types, whole = found.fitted.types, found.fitted.whole
    if found.selection is not None:
        _show_selection(found.selection)
    reward = np.array(found.plays.reward)
    mean = partial(_mean, found.fitted.shares)
    rows = [
        (str(number), str(found.items[number - 1]), _numbers(mean(chain) @ reward),
         _numbers(np.diagonal(chain.play)), _numbers(chain.prior))
        for number, chain in enumerate(types.chains, 1)
    ]  # fmt: skip
    columns = ("model", "items", "reward by state", "stays by a play", "prior")
    show_table(columns, rows)
    say()
    say(_told(whole, found))
    if found.judged:
        say(_compared(found))
    for warning in (*found.identified.warnings, *_warnings(found)):
        note(f"Warning: {warning}")
    say(f"{out}/models.ndjson, {out}/items.ndjson, {out}/report.json")


def _mean(shares: Floats, chain: Chain) -> Floats:
    """(S, K) chances of signals in the mean mood."""
    mean: Floats = np.tensordot(shares, chain.observe, 1)
    return mean


def _show_selection(found: Selection) -> None:
    if not found.tried:
        return
    show_table(
        ("states", "types", "log loss", "over the best", ""),
        [_cells(each, found) for each in found.tried],
    )
    say(f"On {found.plays} plays, the last of each user, that were not learned from.")
    say()


def _cells(each: Tried, found: Selection) -> Sequence[str]:
    chosen = (each.states, each.types) == (found.states, found.types)
    return (
        str(each.states),
        str(each.types),
        f"{each.log_loss:.4f}",
        f"{each.worse:+.4f} ± {each.error:.4f}" if each.error else "",
        "chosen" if chosen else "",
    )


def _told(whole: Learned, found: Found) -> str:
    learned = found.plays.of(found.split.learned)
    per_answer = -whole.counts.likelihood / max((learned.answer != NONE).sum(), 1)
    return (
        f"{len(learned)} plays of {len(np.unique(learned.user))} users: log loss"
        f" {per_answer:.4f} on what it was learned from, after {len(whole.risen)} steps"
        f" and {found.seconds:.0f} s. The log tells {found.identified.states} states"
        f" apart.{_new(found.placed)}"
    )


def _compared(found: Found) -> str:
    held = len(found.plays) - int(found.split.learned.sum())
    losses = ", ".join(
        f"{score.forecaster} {score.log_loss:.4f}" for score in found.judged
    )
    return f"Log loss on the {held} plays that were held out: {losses}."


def _new(placed: Placed) -> str:
    counts = placed.counts
    new = counts["by_tag"] + counts["by_neither"]
    if not new:
        return ""
    return (
        f" Of {new} items without plays, {counts['by_tag']} take after others of a tag."
    )


def _warnings(found: Found) -> Sequence[str]:
    said: list[str] = []
    if found.selection is not None and not found.selection.tried:
        said.append(
            "The log is too short to choose states and types by: the fewest were taken."
        )
    if not (found.fitted.whole.settled and found.fitted.types.settled):
        said.append("It had not settled: give it more --steps.")
    return said


def _numbers(values: "np.typing.NDArray[np.float64]") -> str:
    return " ".join(f"{value:.2f}" for value in values)
