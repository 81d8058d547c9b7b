"""Item models: put, seen, retired. Each change is a version; none is ever lost."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from app.domain import ItemModel, ItemSignals, Revision
from app.errors import Fault, ModelInUse, ModelNotFound
from app.services import index_coverage, index_tables, mood_rules
from app.services.changes import Change
from app.services.in_force import needs
from app.services.mathematics import mathematical
from app.services.new_models import NewModel, check, signals_of
from app.storage import audit, models, revision
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a model becomes.

    moved:   beliefs take on a new meaning with it
    dropped: signals that its items may have had as answers, and that it has no longer
    """

    model: ItemModel
    change: Change
    moved: bool = False
    dropped: Sequence[str] = ()

    @property
    def warnings(self) -> Sequence[str]:
        """What is allowed, but looks like a mistake."""
        found = warnings(self.model)
        return (*found, _lost(self.dropped)) if self.dropped else found


def find(store: Store, model_id: str, version: int | None) -> ItemModel:
    """The latest version of a model, or an earlier one."""
    if version is None:
        model = models.latest(store, model_id)
    else:
        model = models.version(store, model_id, version)
    if model is None or model.retired:
        raise ModelNotFound(model_id, version)
    return model


def page(store: Store, after: str, limit: int) -> Sequence[ItemModel]:
    return models.page(store, after, limit)


def put(store: Store, new: NewModel, by: str) -> Outcome:
    """Create a model or a new version of it."""
    known = revision.current(store)
    becomes = outcome(store, new)
    put_all(store, known, [becomes], by)
    return becomes


def put_all(
    store: Store, known: Revision, outcomes: Sequence[Outcome], by: str
) -> None:
    """Note what models become, with tables if need be, all in one catalogue."""
    changed = [each.model for each in outcomes if each.change is not Change.UNCHANGED]
    if not changed:
        return
    tables = index_coverage.of_new(store, changed, needs(store, known))
    moved = mood_rules.check(store, known, changed)
    moved = moved or any(each.moved for each in outcomes)
    revision.rely_on_policies(store, known)
    catalogue = revision.advance_catalogue(store, known, new_epoch=moved)
    index_tables.insert(store, tables, catalogue)
    insert(store, changed, catalogue, by)


def insert(store: Store, changed: Sequence[ItemModel], catalogue: int, by: str) -> None:
    """Note new versions of models, in use from a catalogue on."""
    for model in changed:
        models.insert(store, replace(model, catalogue=catalogue))
        detail = {"version": model.version}
        audit.note(store, model.created_at, by, "put_model", model.id, detail)


def outcome(store: Store, new: NewModel) -> Outcome:
    """What a model becomes when it is put; its catalogue is stamped later."""
    present = models.latest(store, new.id)
    if present is None or present.retired:
        version = 1 if present is None else present.version + 1
        return Outcome(_version(new, version), Change.CREATED)
    becomes = _version(new, present.version + 1)
    if description(becomes) == description(present):
        return Outcome(present, Change.UNCHANGED)
    if _chances(becomes) == _chances(present) or not models.count_items(store, new.id):
        return Outcome(becomes, Change.REPLACED)
    dropped = [name for name in present.answers if name not in becomes.answers]
    return Outcome(becomes, Change.REPLACED, moved=True, dropped=dropped)


def retire(store: Store, model_id: str, by: str) -> None:
    """End a model that no item uses."""
    known = revision.current(store)
    present = find(store, model_id, None)
    count = models.count_items(store, model_id)
    if count > 0:
        raise ModelInUse(
            f"{count} items use the model {model_id!r}, retired ones included;"
            " put them to another model first.",
            Fault("model", f"used by {count} items", model_id),
        )
    catalogue = revision.advance_catalogue(store, known, new_epoch=False)
    end(store, present, catalogue, by)


def end(store: Store, present: ItemModel, catalogue: int, by: str) -> None:
    """Note that a model is in use no longer."""
    now, version = datetime.now(UTC), present.version + 1
    last = replace(
        present, version=version, created_at=now, catalogue=catalogue, retired=True
    )
    models.insert(store, last)
    audit.note(store, now, by, "delete_model", present.id)


def warnings(model: ItemModel) -> Sequence[str]:
    """What of a model is allowed, but looks like a mistake."""
    return mathematical(model).warnings


def signals(model: ItemModel) -> ItemSignals:
    """What a play may tell, also where that is a skip or a like."""
    if model.signals is not None:
        return model.signals
    plain = mathematical(model)
    return ItemSignals(plain.signals, plain.observe.tolist(), plain.reward.tolist())


def _lost(signals: Sequence[str]) -> str:
    names = ", ".join(map(repr, signals))
    return (
        f"Items use this model, which no longer has the signals {names}: plays that"
        " were answered so now count as never answered."
    )


def _chances(model: ItemModel) -> tuple[object, ...]:
    """What beliefs are made of."""
    chains = model.play, model.rest, model.prior, model.samples
    if model.mood is not None:
        signals = model.signals
        rewards = None if signals is None else (signals.names, signals.reward)
        return *chains, model.mood, rewards
    if model.signals is None:
        return *chains, model.like
    return *chains, replace(model.signals, fractions=None)


def description(model: ItemModel) -> tuple[object, ...]:
    """What a client tells of a model; versions that differ in nothing are one."""
    fractions = None if model.signals is None else model.signals.fractions
    return _chances(model), model.states, fractions, model.source


def _version(new: NewModel, version: int) -> ItemModel:
    model = check(new)
    return ItemModel(
        id=new.id,
        version=version,
        states=new.states,
        play=new.play,
        rest=new.rest,
        like=model.like.tolist() if new.like is None else new.like,
        prior=new.prior,
        source=new.source,
        created_at=datetime.now(UTC),
        catalogue=0,
        signals=signals_of(new, model),
        mood=new.mood,
        samples=new.samples,
    )
