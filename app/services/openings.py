"""What a new user meets: the items of a catalogue, of which none was ever played."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain import ItemModel
from app.errors import Fault, NothingToPlay
from app.services import new_models
from app.services.catalogue import Catalogue
from app.services.items import NewItem
from app.services.lines import LineFile
from app.services.live import Live
from app.services.mathematics import mathematical
from app.services.mood_rules import common
from app.services.new_models import NewModel
from app.storage import revision
from app.storage.store import Store
from policies import Ints, Model, Situation, as_ints
from simulation import drawn, example, opening
from simulation.examples import NUMBERS


@dataclass(frozen=True, slots=True, eq=False)
class Opening:
    """The items of each model as one group.

    models:    ids
    situation: a group for each of them, in this order
    """

    models: Sequence[str]
    situation: Situation

    @property
    def is_moody(self) -> bool:
        """Whether a model has a mood: then there is no bound."""
        return self.situation.models.classes > 1

    @property
    def items(self) -> Sequence[int]:
        """How many there are of each model."""
        counts: list[int] = self.situation.count.tolist()
        return counts


def present(store: Store, live: Live) -> Opening:
    """That of the catalogue as it is now."""
    return of_catalogue(live.catalogue(store, revision.current(store)))


def of_catalogue(catalogue: Catalogue) -> Opening:
    """The active items of a catalogue; models without any are left out."""
    held = np.array([len(items) for items in catalogue.pool.by_model], np.int64)
    used = np.flatnonzero(held).tolist()
    versions: list[ItemModel] = [catalogue.versions[row] for row in used]
    return _of(
        [version.id for version in versions],
        [mathematical(version) for version in versions],
        held[used],
    )


def of_models(models: Sequence[NewModel]) -> Opening:
    """One item of each model."""
    common((model.id, model.mood) for model in models)
    return _of(
        [model.id for model in models],
        [new_models.check(model) for model in models],
    )


def of_files(models: Sequence[NewModel], items: LineFile[NewItem]) -> Opening:
    """The active items of a file; models without any are left out."""
    common((model.id, model.mood) for model in models)
    faults, seen = items.faults(), set[str]()
    counts = dict.fromkeys((model.id for model in models), 0)
    for line, item in items.entries(faults):
        if item.id in seen:
            faults.add(line, Fault("id", "is there twice", item.id))
        elif item.model not in counts:
            faults.add(line, Fault("model", f"unknown model {item.model!r}"))
        else:
            counts[item.model] += item.active
        seen.add(item.id)
    faults.refuse()
    used = [model for model in models if counts[model.id]]
    return _of(
        [model.id for model in used],
        [new_models.check(model) for model in used],
        as_ints([counts[model.id] for model in used]),
    )


def of_example(number: int, seed: int) -> Opening:
    """An example of the paper, of which the fourth is drawn by a seed."""
    if number in NUMBERS:
        paper = example(number)
        return _of(paper.ids, paper.models)
    models = drawn(seed)
    return _of([f"item-{place}" for place in range(1, len(models) + 1)], models)


def _of(
    ids: Sequence[str], models: Sequence[Model], items: Ints | None = None
) -> Opening:
    if not ids:
        raise NothingToPlay("There are no items to play.")
    return Opening(ids, opening(models, items))
