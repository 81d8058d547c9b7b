"""How far the index tables are that a policy needs, and seeing that it can be used.

While a policy that needs tables is in force, each model has at least a rough one: the
unit of work that puts the policy or the model in force makes those that are missing, so
that no decision has to wait for one. Full ones follow, see `index_builds`.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from app.domain import ItemModel, Precision, Revision
from app.errors import Fault, SamplesApart, TooManyStates
from app.services import index_tables
from app.services.index_tables import Built
from app.storage import index_tables as stored
from app.storage import models, revision
from app.storage.index_tables import TableRecord
from app.storage.store import Store

MOST_STATES = 21  # beyond, not even the coarsest grid is small
NAMED = 5  # models that a warning names


@dataclass(frozen=True, slots=True)
class Need:
    """The tables that a policy looks scores up in.

    by_sample: whether it has a use for a table of each sample of a model
    """

    discount: float
    by_sample: bool


@dataclass(frozen=True, slots=True)
class Coverage:
    """The tables of all models of a catalogue at one discount.

    of:            models
    ready:         how many have a full table
    rough:         how many have a rough one only
    not_indexable: models for which Whittle's index means nothing
    too_large:     models of too many states to have a table
    sampled:       models of samples, where the policy needs one table for all of them
    """

    discount: float
    of: int
    ready: int
    rough: int
    not_indexable: Sequence[str]
    too_large: Sequence[str]
    sampled: Sequence[str] = ()

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
        if self.sampled:
            told.append(f"{_sampled(self.sampled)} This policy can choose no play.")
        return told


def coverage(store: Store, known: Revision, need: Need | None) -> Coverage | None:
    """What tables there are of those needed; None: none is needed."""
    if need is None:
        return None
    versions = models.at(store, known.catalogue)
    present = finest(store, versions, need.discount)
    return _coverage(need, versions, present.values())


def ensure(store: Store, known: Revision, needs: Sequence[Need]) -> Sequence[Coverage]:
    """Make rough tables for the models that have none; tell what there is then."""
    if not needs:
        return ()
    revision.rely_on_catalogue(store, known)
    versions = models.at(store, known.catalogue)
    found, new = [], list[Built]()
    for need in needs:
        present = {
            **finest(store, versions, need.discount),
            **_at_discount(new, need.discount),
        }
        made = _rough_ones(store, versions, need, present)
        records = (*present.values(), *(table.record for table in made))
        found.append(_coverage(need, versions, records))
        new += made
    if new:
        catalogue = revision.advance_catalogue(store, known, new_epoch=False)
        index_tables.insert(store, new, catalogue)
    return found


def of_new(
    store: Store, versions: Sequence[ItemModel], needs: Sequence[Need]
) -> Sequence[Built]:
    """Make rough tables for models that are put; none if none is needed."""
    check_usable(versions, needs)
    new: list[Built] = []
    for need in needs:
        present = _at_discount(new, need.discount)
        new += _rough_ones(store, versions, need, present)
    return new


def finest(
    store: Store, versions: Iterable[ItemModel], discount: float
) -> Mapping[tuple[str, int, int], TableRecord]:
    """The finest tables there are of these models, by id, version and sample."""
    wanted = {(model.id, model.version) for model in versions}
    found: dict[tuple[str, int, int], TableRecord] = {}
    for record in stored.at_discount(store, discount):
        place = record.model, record.version, record.sample
        better = place not in found or record.precision is Precision.FULL
        if better and place[:2] in wanted:
            found[place] = record
    return found


def is_small(model: ItemModel) -> bool:
    """Whether tables are made for a model of so many states."""
    return len(model.states) <= MOST_STATES


def usable(model: ItemModel, need: Need) -> bool:
    """Whether a policy can look scores up in the tables made for a model."""
    return is_small(model) and (need.by_sample or model.samples is None)


def check_usable(versions: Sequence[ItemModel], needs: Sequence[Need]) -> None:
    """Refuse models of which a policy has no use."""
    for need in needs:
        refuse(_coverage(need, versions, ()))


def refuse(found: Coverage) -> None:
    """Refuse a policy beside models of which it has no table."""
    if found.too_large:
        large = [
            Fault("states", f"more than {MOST_STATES}", model)
            for model in found.too_large
        ]
        raise TooManyStates(
            f"The policy needs index tables, which are made for models of up to"
            f" {MOST_STATES} states; of more: {_few(found.too_large)}.",
            *large,
        )
    if found.sampled:
        samples = [Fault("samples", "has some", model) for model in found.sampled]
        raise SamplesApart(
            f"{_sampled(found.sampled)} Put `thompson`, which follows any policy, in"
            " force first.",
            *samples,
        )


def _sampled(models: Sequence[str]) -> str:
    return (
        "Index tables are made for each sample of a model, and the policy needs one for"
        f" all samples of {_few(models)}."
    )


def _rough_ones(
    store: Store,
    versions: Iterable[ItemModel],
    need: Need,
    present: Mapping[tuple[str, int, int], TableRecord],
) -> Sequence[Built]:
    make = partial(index_tables.rough, discount=need.discount)
    return [
        store.aside(partial(make, model, sample))
        for model in versions
        if usable(model, need)
        for sample in range(model.chains)
        if (model.id, model.version, sample) not in present
    ]


def _at_discount(
    tables: Iterable[Built], discount: float
) -> Mapping[tuple[str, int, int], TableRecord]:
    records = (table.record for table in tables)
    return {
        (record.model, record.version, record.sample): record
        for record in records
        if record.discount == discount
    }


def _few(models: Sequence[str]) -> str:
    rest = len(models) - NAMED
    named = ", ".join(map(repr, models[:NAMED]))
    return named if rest <= 0 else f"{named} and {rest} more"


def _coverage(
    need: Need, versions: Sequence[ItemModel], records: Iterable[TableRecord]
) -> Coverage:
    found = list(records)
    full = Counter(each.model for each in found if each.precision is Precision.FULL)
    there = Counter(each.model for each in found)
    ready = sum(full[model.id] == model.chains for model in versions)
    covered = sum(there[model.id] == model.chains for model in versions)
    return Coverage(
        need.discount,
        len(versions),
        ready,
        covered - ready,
        sorted({record.model for record in found if not record.indexable}),
        [model.id for model in versions if not is_small(model)],
        [model.id for model in versions if is_small(model) and not usable(model, need)],
    )
