"""Item models: put, seen, retired. Each change is a version; none is ever lost."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from operator import attrgetter

from app.domain import ItemModel, Revision
from app.errors import Fault, ModelInUse, ModelNotFound, UnusableModel
from app.services.catalogue import mathematical
from app.services.changes import Change
from app.storage import audit, models, revision
from app.storage.store import Store
from policies import InvalidModel, Model

CHANCES = attrgetter("play", "rest", "like", "prior")
DESCRIPTION = attrgetter("states", "play", "rest", "like", "prior", "source")


@dataclass(frozen=True, slots=True)
class NewModel:
    """A model as a client describes it."""

    id: str
    states: Sequence[str]
    play: Sequence[Sequence[float]]
    rest: Sequence[Sequence[float]]
    like: Sequence[float]
    prior: Sequence[float]
    source: str = ""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a model becomes. `moved`: beliefs take on a new meaning with it."""

    model: ItemModel
    change: Change
    moved: bool = False


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


def put(store: Store, new: NewModel, by: str) -> tuple[ItemModel, bool]:
    """Create a model or a new version of it; tell whether it is new."""
    check(new)
    known = revision.current(store)
    becomes = outcome(store, new)
    put_all(store, known, [becomes], by)
    return becomes.model, becomes.change is Change.CREATED


def put_all(
    store: Store, known: Revision, outcomes: Sequence[Outcome], by: str
) -> None:
    """Note what models become, all in one catalogue."""
    changed = [each.model for each in outcomes if each.change is not Change.UNCHANGED]
    if not changed:
        return
    moved = any(each.moved for each in outcomes)
    catalogue = revision.advance_catalogue(store, known, new_epoch=moved)
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
    if DESCRIPTION(new) == DESCRIPTION(present):
        return Outcome(present, Change.UNCHANGED)
    same = CHANCES(new) == CHANCES(present)
    moved = not same and models.count_items(store, new.id) > 0
    return Outcome(_version(new, present.version + 1), Change.REPLACED, moved)


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
    now = datetime.now(UTC)
    last = replace(
        present,
        version=present.version + 1,
        created_at=now,
        catalogue=revision.advance_catalogue(store, known, new_epoch=False),
        retired=True,
    )
    models.insert(store, last)
    audit.note(store, now, by, "delete_model", model_id)


def check(new: NewModel) -> None:
    """Refuse what makes no pair of Markov chains."""
    try:
        Model(new.states, new.play, new.rest, new.like, new.prior)
    except InvalidModel as error:
        field = error.field.replace("[", ".").replace("]", "")
        message = str(error).removeprefix(f"{error.field}: ")
        raise UnusableModel(f"{error}.", Fault(field, message)) from error


def warnings(model: ItemModel) -> Sequence[str]:
    """What is allowed, but looks like a mistake."""
    return mathematical(model).warnings


def _version(new: NewModel, version: int) -> ItemModel:
    return ItemModel(
        id=new.id,
        version=version,
        states=new.states,
        play=new.play,
        rest=new.rest,
        like=new.like,
        prior=new.prior,
        source=new.source,
        created_at=datetime.now(UTC),
        catalogue=0,
    )
