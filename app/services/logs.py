"""The service's own log of plays, to learn from."""

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np

from app.domain import ItemModel
from app.services import models as item_models
from app.services.items import NewItem, described
from app.storage import items, models, plays, revision
from app.storage.database import Database
from app.storage.plays import LogRow
from app.storage.store import Store
from learning import NONE, Plays
from policies import Floats, Ints

PAGE = 5000


class CannotLearn(Exception):
    """There is nothing to learn from, or it does not go together."""


@dataclass(slots=True)
class Names:
    """Numbers of names, in the order in which they come."""

    number: dict[str, int] = field(default_factory=dict)

    def of(self, name: str) -> int:
        return self.number.setdefault(name, len(self.number))


@dataclass(slots=True)
class Columns:
    """Plays as they are gathered."""

    users: Names = field(default_factory=Names)
    arms: Names = field(default_factory=Names)
    user: "array[int]" = field(default_factory=lambda: array("q"))
    arm: "array[int]" = field(default_factory=lambda: array("q"))
    answer: "array[int]" = field(default_factory=lambda: array("b"))
    slot: "array[int]" = field(default_factory=lambda: array("q"))
    seconds: "array[float]" = field(default_factory=lambda: array("d"))
    propensity: "array[float]" = field(default_factory=lambda: array("d"))

    def add(self, row: LogRow, signals: Mapping[str, int]) -> None:
        self.user.append(self.users.of(row.user))
        self.arm.append(self.arms.of(row.item))
        self.answer.append(signals.get(row.signal, NONE))
        self.slot.append(row.closed)
        self.seconds.append(row.created_at.timestamp())
        chance = float("nan") if row.propensity is None else row.propensity
        self.propensity.append(chance)


async def log(
    database: Database, progress: Callable[[int], object] = lambda _plays: None
) -> Plays:
    """All plays that took place, in memory; `progress` is told how many there are."""
    kept = await database.run(models_now)
    names, reward = common_signals(kept)
    signals = {name: number for number, name in enumerate(names)}
    gathered = Columns()
    after = ("", -1, 0)
    while some := await database.run(partial(plays.log, after=after, limit=PAGE)):
        for row in some:
            gathered.add(row, signals)
        after = (some[-1].user, some[-1].closed, some[-1].place)
        progress(len(gathered.user))
    if not gathered.user:
        raise CannotLearn("There is no play to learn from.")
    return _plays(gathered, names, reward)


async def catalogue(database: Database) -> Sequence[NewItem]:
    """All items as their client described them, retired ones too."""
    found: list[NewItem] = []
    after = -1
    while some := await database.run(partial(items.in_order, after=after)):
        found.extend(map(described, some))
        after = some[-1].serial
    return found


def models_now(store: Store) -> Sequence[ItemModel]:
    """All models, in the version that is in force."""
    return models.at(store, revision.current(store).catalogue)


def common_signals(kept: Sequence[ItemModel]) -> tuple[Sequence[str], Sequence[float]]:
    """The signals that all models have, and what they are worth."""
    found = {_signals(model): model.id for model in kept}
    if len(found) > 1:
        one, other = list(found.values())[:2]
        raise CannotLearn(
            f"The models {one!r} and {other!r} have different signals: what is learned"
            " together must be answered alike."
        )
    [(names, reward)] = found or [(("skip", "like"), (0.0, 1.0))]
    return names, reward


def _signals(model: ItemModel) -> tuple[tuple[str, ...], tuple[float, ...]]:
    signals = item_models.signals(model)
    return tuple(signals.names), tuple(signals.reward)


def _plays(gathered: Columns, names: Sequence[str], reward: Sequence[float]) -> Plays:
    user = np.array(gathered.user, dtype=np.int64)
    return Plays(
        user,
        np.array(gathered.arm, dtype=np.int64),
        np.array(gathered.answer, dtype=np.int8),
        _ascending(np.array(gathered.seconds), user),
        np.array(gathered.propensity),
        [*gathered.users.number],
        [*gathered.arms.number],
        tuple(names),
        tuple(reward),
        np.array(gathered.slot, dtype=np.int64),
    )


def _ascending(seconds: Floats, user: Ints) -> Floats:
    """Times that never fall within a user: of an import they may be anything."""
    raised = seconds.copy()
    for first, end in pairwise(np.flatnonzero(np.diff(user, prepend=-1, append=-1))):
        np.maximum.accumulate(seconds[first:end], out=raised[first:end])
    return raised
