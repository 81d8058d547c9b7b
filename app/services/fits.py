"""Models that were learned from a log, as an import reads them."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.domain import LIKE, SKIP
from learning import Plays
from learning.chain import Chain
from learning.fitting import Fitted
from learning.rests import moves_of

NAMES: Mapping[int, Sequence[str]] = {
    2: ("low", "high"),
    3: ("low", "medium", "high"),
    4: ("low", "medium", "high", "very high"),
}
DIGITS = 9


@dataclass(frozen=True, slots=True)
class Naming:
    """What learned models are called, and where they come from.

    slot_s: seconds of a slot, of chains that rest by the clock
    """

    prefix: str
    source: str
    slot_s: float


def model_lines(fitted: Fitted, plays: Plays, naming: Naming) -> Iterator[str]:
    """Models as `import models` reads them, one for each type."""
    for number, chain in enumerate(fitted.types.chains, 1):
        name = _name(fitted, naming, number)
        yield json.dumps(_model(chain, plays, name, naming), ensure_ascii=False)


def item_lines(fitted: Fitted, plays: Plays, naming: Naming) -> Iterator[str]:
    """Items as `import items` reads them, each with the model it follows."""
    kinds = fitted.types.of_arms.tolist()
    for arm, kind in zip(plays.arms, kinds, strict=True):
        model = _name(fitted, naming, kind + 1)
        yield json.dumps({"id": arm, "model": model}, ensure_ascii=False)


def write(folder: Path, name: str, lines: Iterator[str]) -> None:
    """Write a file, whole or not at all."""
    part = folder / f"{name}.part"
    with part.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in lines)
    part.replace(folder / name)


def _name(fitted: Fitted, naming: Naming, number: int) -> str:
    alone = len(fitted.types.chains) == 1
    return naming.prefix if alone else f"{naming.prefix}-{number}"


def _model(
    chain: Chain, plays: Plays, name: str, naming: Naming
) -> Mapping[str, object]:
    size = len(chain.prior)
    rest = chain.rest
    if chain.in_time:
        [rest] = moves_of(chain, np.array([naming.slot_s]))
    return {
        "id": name,
        "states": NAMES.get(size) or [f"state {n}" for n in range(1, size + 1)],
        "play": _rounded(chain.play),
        "rest": _rounded(rest),
        **_answers(chain, plays),
        "prior": _rounded(chain.prior),
        "source": naming.source,
    }


def _answers(chain: Chain, plays: Plays) -> Mapping[str, object]:
    [observe] = chain.observe
    if tuple(plays.signals) == (SKIP, LIKE) and plays.reward == (0.0, 1.0):
        return {"like": _rounded(observe[:, 1])}
    return {
        "signals": list(plays.signals),
        "observe": _rounded(observe),
        "reward": list(plays.reward),
    }


def _rounded(values: "np.typing.NDArray[np.float64]") -> object:
    return np.round(values, DIGITS).tolist()
