"""Models that were learned from a log, as an import reads them."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import compress
from pathlib import Path

import numpy as np

from app.domain import LIKE, SKIP
from app.services.items import NewItem
from learning import NONE, Bools, Plays
from learning.chain import Chain
from learning.evaluation import Score, compare
from learning.evaluation.rates import arm_rate, constant
from learning.fitting import Fitted, expected, moods_of
from learning.inheritance import Inherited, inherit
from learning.posterior import Posterior
from learning.prediction import liked, predicted
from learning.rests import moves_of
from policies import Floats, Ints, Mood, as_ints

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


def model_lines(
    fitted: Fitted, plays: Plays, naming: Naming, drawn: Sequence[Posterior] = ()
) -> Iterator[str]:
    """Models as `import models` reads them, one for each type.

    drawn: what each of them may be as well as not; empty: nobody asked
    """
    for number, chain in enumerate(fitted.types.chains):
        model = {
            "id": _name(fitted, naming, number + 1),
            **_states(chain),
            **_moves(chain, naming),
            **_answers(chain, plays, fitted),
            "source": naming.source,
        }
        if drawn:
            model["samples"] = [
                _moves(each, naming) | _chances(each, plays, fitted)
                for each in drawn[number].chains
            ]
        yield json.dumps(model, ensure_ascii=False)


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Items, and the models that they follow.

    items: as they are described
    found: which type each is of, and why
    stay:  whether items of which nothing is told stay with the models they have
    """

    items: Sequence[NewItem]
    found: Inherited
    stay: bool

    @property
    def follows(self) -> Sequence[tuple[NewItem, int]]:
        """Items that follow a learned model, and its number."""
        told = zip(self.found.played, self.found.tag, strict=True)
        moves = [played or tag is not None or not self.stay for played, tag in told]
        pairs = zip(self.items, self.found.kind.tolist(), strict=True)
        return [*compress(pairs, moves)]

    @property
    def counts(self) -> Mapping[str, int]:
        """How many follow what they were played, a tag, or the usual type."""
        pairs = [*zip(self.found.played, self.found.tag, strict=True)]
        return {
            "by_plays": sum(played for played, _ in pairs),
            "by_tag": sum(not played and tag is not None for played, tag in pairs),
            "by_neither": sum(not played and tag is None for played, tag in pairs),
        }

    def of(self, arms: Sequence[str], usual: Ints) -> Ints:
        """Which type each arm follows: of an arm that is no item, the usual one."""
        kind = {item.id: number for item, number in self.follows}
        pairs = zip(arms, usual.tolist(), strict=True)
        return as_ints([kind.get(arm, other) for arm, other in pairs])


def place(
    fitted: Fitted, plays: Plays, items: Sequence[NewItem] | None, *, stay: bool
) -> Placed:
    """Find the models of items; None: of those that the log names."""
    known = [NewItem(arm, "") for arm in plays.arms] if items is None else items
    tags = {item.id: item.tags for item in known}
    found = inherit(fitted.types, plays.arms, np.unique(plays.arm), tags)
    return Placed(known, found, stay)


def item_lines(fitted: Fitted, placed: Placed, naming: Naming) -> Iterator[str]:
    """Items as `import items` reads them, each with the model it follows."""
    for item, kind in placed.follows:
        plain: dict[str, object] = {
            "id": item.id,
            "model": _name(fitted, naming, kind + 1),
        }
        more = {"title": item.title, "tags": item.tags, "payload": item.payload}
        plain |= {name: value for name, value in more.items() if value}
        plain |= {} if item.active else {"active": False}
        yield json.dumps(plain, ensure_ascii=False)


def judged(
    plays: Plays,
    learned: Bools,
    fitted: Fitted,
    placed: Placed,
    plain: Fitted | None = None,
) -> Sequence[Score]:
    """How well plays are foretold that models were not learned from; none: nothing.

    plain: the same, learned without a mood, to tell what that gains
    """
    held = ~learned & (plays.answer != NONE)
    if not held.any():
        return ()
    chances = {
        "learned": liked(plays, _expected(plays, fitted, placed)),
        **({} if plain is None else {MOODLESS: liked(plays, expected(plays, plain))}),
        "user-arm rate": arm_rate(plays, learned),
        "constant": constant(plays, learned),
    }
    return compare(plays, held, chances)[2]


def _expected(plays: Plays, fitted: Fitted, placed: Placed) -> Floats:
    """What is foretold if arms follow the models that are written."""
    of_arms = placed.of(plays.arms, fitted.types.of_arms)
    chains, recipe = fitted.types.chains, fitted.recipe
    mood = moods_of(plays, recipe.mood)
    return predicted(plays, chains, of_arms, mood, in_time=recipe.in_time)


def write(folder: Path, name: str, lines: Iterator[str]) -> None:
    """Write a file, whole or not at all."""
    part = folder / f"{name}.part"
    with part.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in lines)
    part.replace(folder / name)


def _name(fitted: Fitted, naming: Naming, number: int) -> str:
    alone = len(fitted.types.chains) == 1
    return naming.prefix if alone else f"{naming.prefix}-{number}"


def _states(chain: Chain) -> dict[str, object]:
    size = len(chain.prior)
    return {"states": NAMES.get(size) or [f"state {n}" for n in range(1, size + 1)]}


def _moves(chain: Chain, naming: Naming) -> dict[str, object]:
    play, rest = chain.play, chain.rest
    if chain.in_time:  # a play takes no time: the slot that it begins is rest, too
        [rest] = moves_of(chain, np.array([naming.slot_s]))
        play = play @ rest
    return {
        "play": _rounded(play),
        "rest": _rounded(rest),
        "prior": _rounded(chain.prior),
    }


def _answers(chain: Chain, plays: Plays, fitted: Fitted) -> dict[str, object]:
    """How plays are answered, and by what mood."""
    mood, told = fitted.recipe.mood, _chances(chain, plays, fitted)
    if mood is not None:
        shares = {"shares": _rounded(fitted.shares)}
        told = {"mood": {**asdict(mood), **shares, **_chances_in(chain, plays)}}
    if _likes(plays):
        return told
    return {"signals": list(plays.signals), "reward": list(plays.reward)} | told


def _chances(chain: Chain, plays: Plays, fitted: Fitted) -> dict[str, object]:
    told = _chances_in(chain, plays)
    if fitted.recipe.mood is not None:
        return {"mood": told}
    return {name: chances[0] for name, chances in told.items()}


def _chances_in(chain: Chain, plays: Plays) -> dict[str, list[object]]:
    """By mood."""
    if _likes(plays):
        return {"like": _rounded(chain.observe[..., 1])}
    return {"observe": _rounded(chain.observe)}


def _likes(plays: Plays) -> bool:
    """Whether a play tells a skip or a like, and no more."""
    return tuple(plays.signals) == (SKIP, LIKE) and plays.reward == (0.0, 1.0)


def _rounded(values: Floats) -> list[object]:
    found: list[object] = np.round(values, DIGITS).tolist()
    return found
