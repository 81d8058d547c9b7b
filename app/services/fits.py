"""Models that were learned from a log, as an import reads them."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from app.domain import LIKE, SKIP
from learning import NONE, Bools, Plays
from learning.chain import Chain
from learning.evaluation import Score, compare
from learning.evaluation.rates import arm_rate, constant
from learning.fitting import Fitted, expected
from learning.prediction import liked
from learning.rests import moves_of
from policies import Mood

NAMES: Mapping[int, Sequence[str]] = {
    2: ("low", "high"),
    3: ("low", "medium", "high"),
    4: ("low", "medium", "high", "very high"),
}
DIGITS = 9
MOODLESS = "without mood"


@dataclass(frozen=True, slots=True)
class Naming:
    """What learned models are called, and where they come from.

    slot_s: seconds of a slot, of chains that rest by the clock
    """

    prefix: str
    source: str
    slot_s: float


def usual_mood(plays: Plays) -> Mood:
    """That of a log; where no times are known, there are no pauses."""
    return Mood() if plays.seconds is not None else Mood(pause_s=None)


def model_lines(fitted: Fitted, plays: Plays, naming: Naming) -> Iterator[str]:
    """Models as `import models` reads them, one for each type."""
    for number, chain in enumerate(fitted.types.chains, 1):
        name = _name(fitted, naming, number)
        model = _model(chain, name, naming) | _answers(chain, plays, fitted)
        yield json.dumps(model, ensure_ascii=False)


def item_lines(fitted: Fitted, plays: Plays, naming: Naming) -> Iterator[str]:
    """Items as `import items` reads them, each with the model it follows."""
    kinds = fitted.types.of_arms.tolist()
    for arm, kind in zip(plays.arms, kinds, strict=True):
        model = _name(fitted, naming, kind + 1)
        yield json.dumps({"id": arm, "model": model}, ensure_ascii=False)


def judged(
    plays: Plays, learned: Bools, fitted: Fitted, plain: Fitted | None = None
) -> Sequence[Score]:
    """How well plays are foretold that models were not learned from; none: nothing.

    plain: the same, learned without a mood, to tell what that gains
    """
    held = ~learned & (plays.answer != NONE)
    if not held.any():
        return ()
    chances = {
        "learned": liked(plays, expected(plays, fitted)),
        **({} if plain is None else {MOODLESS: liked(plays, expected(plays, plain))}),
        "user-arm rate": arm_rate(plays, learned),
        "constant": constant(plays, learned),
    }
    return compare(plays, held, chances)[2]


def write(folder: Path, name: str, lines: Iterator[str]) -> None:
    """Write a file, whole or not at all."""
    part = folder / f"{name}.part"
    with part.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in lines)
    part.replace(folder / name)


def _name(fitted: Fitted, naming: Naming, number: int) -> str:
    alone = len(fitted.types.chains) == 1
    return naming.prefix if alone else f"{naming.prefix}-{number}"


def _model(chain: Chain, name: str, naming: Naming) -> dict[str, object]:
    size = len(chain.prior)
    rest = chain.rest
    if chain.in_time:
        [rest] = moves_of(chain, np.array([naming.slot_s]))
    return {
        "id": name,
        "states": NAMES.get(size) or [f"state {n}" for n in range(1, size + 1)],
        "play": _rounded(chain.play),
        "rest": _rounded(rest),
        "prior": _rounded(chain.prior),
        "source": naming.source,
    }


def _answers(chain: Chain, plays: Plays, fitted: Fitted) -> dict[str, object]:
    mood = fitted.recipe.mood
    observe = chain.observe[0] if mood is None else chain.observe
    if tuple(plays.signals) == (SKIP, LIKE) and plays.reward == (0.0, 1.0):
        told = {"like": _rounded(observe[..., 1])}
        return told if mood is None else {"mood": _mood(mood, fitted) | told}
    told = {"observe": _rounded(observe)}
    return {
        "signals": list(plays.signals),
        "reward": list(plays.reward),
        **(told if mood is None else {"mood": _mood(mood, fitted) | told}),
    }


def _mood(mood: Mood, fitted: Fitted) -> dict[str, object]:
    return asdict(mood) | {"shares": _rounded(fitted.shares)}


def _rounded(values: "np.typing.NDArray[np.float64]") -> object:
    return np.round(values, DIGITS).tolist()
