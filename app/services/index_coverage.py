"""How far the index tables are that a policy needs, and seeing that it can be used.

While a policy that needs tables is in force, each model has at least a rough one: the
unit of work that puts the policy or the model in force makes those that are missing, so
that no decision has to wait for one. Full ones follow, see `index_builds`.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from app.domain import ItemModel, Precision, Revision
from app.errors import Fault, TooManyStates
from app.services import index_tables
from app.services.index_tables import Built
from app.storage import index_tables as stored
from app.storage import models, revision
from app.storage.index_tables import TableRecord
from app.storage.store import Store

MOST_STATES = 21  # beyond, not even the coarsest grid is small
NAMED = 5  # models that a warning names


@dataclass(frozen=True, slots=True)
class Coverage:
    """The tables of all models of a catalogue at one discount.

    of:            models
    ready:         how many have a full table
    rough:         how many have a rough one only
    not_indexable: models for which Whittle's index means nothing
    too_large:     models of too many states to have a table
    """

    discount: float
    of: int
    ready: int
    rough: int
    not_indexable: Sequence[str]
    too_large: Sequence[str]

    @property
    def warnings(self) -> Sequence[str]:
        """Why the policy does not do, or not only, what its name says."""
        told = []
        if self.not_indexable:
            told.append(
                f"Not indexable at discount {self.discount}:"
                f" {_few(self.not_indexable)}. Where the policy asks for Whittle's"
                " index, it uses the Lagrangian index."
            )
        if self.too_large:
            told.append(
                f"Of more than {MOST_STATES} states: {_few(self.too_large)}. No index"
                " tables are made for them, so that this policy can choose no play."
            )
        return told


def coverage(store: Store, known: Revision, discount: float | None) -> Coverage | None:
    """What tables there are at a discount; None: none is needed."""
    if discount is None:
        return None
    versions = models.at(store, known.catalogue)
    present = finest(store, versions, discount)
    return _coverage(discount, versions, present.values())


def ensure(store: Store, known: Revision, discount: float | None) -> Coverage | None:
    """Make rough tables for the models that have none; tell what there is then."""
    if discount is None:
        return None
    revision.rely_on_catalogue(store, known)
    versions = models.at(store, known.catalogue)
    present = finest(store, versions, discount)
    lacking = [each for each in versions if (each.id, each.version) not in present]
    made = _rough_ones(store, filter(is_small, lacking), discount)
    if made:
        catalogue = revision.advance_catalogue(store, known, new_epoch=False)
        index_tables.insert(store, made, catalogue)
    records = (*present.values(), *(table.record for table in made))
    return _coverage(discount, versions, records)


def of_new(
    store: Store, versions: Sequence[ItemModel], discount: float | None
) -> Sequence[Built]:
    """Make rough tables for models that are put; none if none is needed."""
    if discount is None:
        return ()
    refuse_large([model.id for model in versions if not is_small(model)])
    return _rough_ones(store, versions, discount)


def finest(
    store: Store, versions: Iterable[ItemModel], discount: float
) -> Mapping[tuple[str, int], TableRecord]:
    """The finest table of each of these models that has one, by id and version."""
    wanted = {(model.id, model.version) for model in versions}
    found: dict[tuple[str, int], TableRecord] = {}
    for record in stored.at_discount(store, discount):
        version = record.model, record.version
        better = version not in found or record.precision is Precision.FULL
        if better and version in wanted:
            found[version] = record
    return found


def is_small(model: ItemModel) -> bool:
    """Whether tables are made for a model of so many states."""
    return len(model.states) <= MOST_STATES


def refuse_large(models: Sequence[str]) -> None:
    """Refuse models of which no table is made."""
    if models:
        raise TooManyStates(
            f"The policy needs index tables, which are made for models of up to"
            f" {MOST_STATES} states; of more: {_few(models)}.",
            *(Fault("states", f"more than {MOST_STATES}", model) for model in models),
        )


def _rough_ones(
    store: Store, versions: Iterable[ItemModel], discount: float
) -> Sequence[Built]:
    make = partial(index_tables.rough, discount=discount)
    return [store.aside(partial(make, model)) for model in versions]


def _few(models: Sequence[str]) -> str:
    rest = len(models) - NAMED
    named = ", ".join(map(repr, models[:NAMED]))
    return named if rest <= 0 else f"{named} and {rest} more"


def _coverage(
    discount: float, versions: Sequence[ItemModel], records: Iterable[TableRecord]
) -> Coverage:
    found = list(records)
    ready = sum(record.precision is Precision.FULL for record in found)
    return Coverage(
        discount,
        len(versions),
        ready,
        len(found) - ready,
        sorted(record.model for record in found if not record.indexable),
        [model.id for model in versions if not is_small(model)],
    )
