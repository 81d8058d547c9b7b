"""What a new user meets: the items of a catalogue, of which none was ever played."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain import ItemModel
from app.errors import NothingToPlay
from app.services import new_models
from app.services.catalogue import Catalogue, mathematical
from app.services.live import Live
from app.services.new_models import NewModel
from app.storage import revision
from app.storage.store import Store
from policies import NEVER, Ints, Model, ModelSet, Situation, as_ints, untouched


@dataclass(frozen=True, slots=True, eq=False)
class Opening:
    """The items of each model as one group.

    models:    ids
    situation: a group for each of them, in this order
    """

    models: Sequence[str]
    situation: Situation

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
    return _opening(
        [version.id for version in versions],
        [mathematical(version) for version in versions],
        held[used],
    )


def of_models(models: Sequence[NewModel]) -> Opening:
    """One item of each model."""
    return _opening(
        [model.id for model in models],
        [new_models.check(model) for model in models],
        np.ones(len(models), np.int64),
    )


def _opening(ids: Sequence[str], models: Sequence[Model], items: Ints) -> Opening:
    if not ids:
        raise NothingToPlay("There are no items to play.")
    stacked = ModelSet.of(models)
    rows = np.arange(len(ids))
    never = np.full(len(ids), NEVER)
    belief = untouched(stacked, 0)
    return Opening(ids, Situation(stacked, rows, belief, as_ints(items), never))
