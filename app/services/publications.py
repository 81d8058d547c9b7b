"""Learned models go live, all at once, and are taken back in one call."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from app.domain import ItemModel, Publication, Revision
from app.errors import NoPublication
from app.services import index_coverage, index_tables, models, mood_rules
from app.services.candidates import Candidate
from app.services.catalogue import Catalogue
from app.services.changes import Change
from app.services.gate import Judged
from app.services.in_force import needs
from app.services.index_tables import Built
from app.services.live import Live
from app.services.models import Outcome
from app.storage import audit, items, publications, revision
from app.storage import models as stored
from app.storage.items import Move
from app.storage.store import Store


class GateClosed(Exception):
    """A candidate may not go live."""


@dataclass(frozen=True, slots=True)
class History:
    """Publications, the latest first; and where the rest begins."""

    publications: Sequence[Publication]
    next: int | None


@dataclass(frozen=True, slots=True)
class TakenBack:
    """A publication that was undone.

    items: how many went back to their model
    kept:  models that somebody has changed since, and that stay as they are
    """

    publication: Publication
    items: int
    kept: Sequence[str]


def history(store: Store, before: int, limit: int) -> History:
    found = publications.page(store, before, limit + 1)
    shown = found[:limit]
    return History(shown, shown[-1].number if len(found) > limit else None)


def publish(
    store: Store, live: Live, candidate: Candidate, judged: Judged, note: str, by: str
) -> Publication:
    """Put the models of a candidate in force, and its items to them.

    All in one catalogue: no request sees some of it. Raises GateClosed if the gate
    refused it, or what it was compared with is in force no longer.
    """
    if not judged.verdict.passed:
        raise GateClosed("It does not pass the gate.")
    known = revision.current(store)
    catalogue = live.catalogue(store, known)
    outcomes = [models.outcome(store, new) for new in candidate.models]
    changed = changed_models(outcomes)
    versions = {model.id: model.version for model in changed}
    if versions != {each.id: each.version for each in changed_models(judged.outcomes)}:
        raise GateClosed("Models have changed since it was judged: judge it again.")
    moves = _moves(catalogue, candidate.items)
    if not changed and not moves:
        raise GateClosed("It is in force already.")
    moved = mood_rules.check(store, known, changed)
    moved = moved or bool(moves) or any(each.moved for each in outcomes)
    tables = _tables(store, known, changed, judged)
    number = revision.advance_catalogue(store, known, new_epoch=moved)
    index_tables.insert(store, tables, number)
    models.insert(store, changed, number, by)
    now = datetime.now(UTC)
    items.move(store, moves, number, now)
    publication = Publication(
        number=publications.latest(store) + 1,
        catalogue=number,
        digest=candidate.digest,
        models=versions,
        items=len(moves),
        verdict=judged.verdict.plain(),
        note=note,
        at=now,
        by=by,
    )
    publications.insert(store, publication)
    detail = {"models": versions, "items": len(moves), "note": note}
    audit.note(store, now, by, "publish", str(publication.number), detail)
    return publication


def take_back(store: Store, live: Live, note: str, by: str) -> TakenBack:
    """Undo the latest publication that stands: models and items as they were.

    What was changed since by others stays. Models that came with the publication end,
    where no item uses them.
    """
    last = publications.standing(store)
    if last is None:
        raise NoPublication("No publication stands.")
    known = revision.current(store)
    catalogue = live.catalogue(store, known)
    moves = [
        _move(catalogue, serial, model)
        for serial, model in items.moved_in(store, last.catalogue)
    ]
    undone = _undone(store, catalogue, last, moves)
    mood_rules.check(store, known, undone.restored, undone.ended)
    tables = index_coverage.of_new(store, undone.restored, needs(store, known))
    number = revision.advance_catalogue(store, known, new_epoch=True)
    index_tables.insert(store, tables, number)
    models.insert(store, undone.restored, number, by)
    for model in undone.ended:
        models.end(store, model, number, by)
    now = datetime.now(UTC)
    items.move(store, moves, number, now)
    publications.undo(store, last.number, now, by)
    audit.note(
        store,
        now,
        by,
        "take_back",
        str(last.number),
        {"items": len(moves), "note": note},
    )
    last = replace(last, undone_at=now, undone_by=by)
    return TakenBack(last, len(moves), undone.kept)


def changed_models(outcomes: Sequence[Outcome]) -> Sequence[ItemModel]:
    """What models become, of those that change."""
    return [each.model for each in outcomes if each.change is not Change.UNCHANGED]


@dataclass(frozen=True, slots=True)
class _Undone:
    """What becomes of the models of a publication."""

    restored: Sequence[ItemModel]
    ended: Sequence[ItemModel]
    kept: Sequence[str]


def _undone(
    store: Store, catalogue: Catalogue, last: Publication, moves: Sequence[Move]
) -> _Undone:
    former = {model.id: model for model in stored.at(store, last.catalogue - 1)}
    follows = list(catalogue.listing.model)
    for move in moves:
        follows[move.serial] = move.model
    used = set(follows)
    restored, ended, kept = [], [], []
    for model_id in {**last.models, **dict.fromkeys(move.model for move in moves)}:
        present = stored.latest(store, model_id)
        if present is None:
            raise LookupError(f"the model {model_id!r} was published, and is not there")
        if not present.retired and not _is_of(store, present, last):
            kept += [model_id] if model_id in last.models else []
        elif model_id in former:
            restored.append(_again(former[model_id], present))
        elif model_id in used:
            kept.append(model_id)
        elif not present.retired:
            ended.append(present)
    return _Undone(restored, ended, kept)


def _is_of(store: Store, present: ItemModel, last: Publication) -> bool:
    """Whether a model is what it became by a publication."""
    version = last.models.get(present.id)
    became = None if version is None else stored.version(store, present.id, version)
    return became is not None and (
        models.description(became) == models.description(present)
    )


def _again(former: ItemModel, present: ItemModel) -> ItemModel:
    """A former model as the next version."""
    version, now = present.version + 1, datetime.now(UTC)
    return replace(former, version=version, created_at=now)


def _moves(catalogue: Catalogue, follows: Mapping[str, str]) -> Sequence[Move]:
    """Items of the catalogue that go to another model than they have."""
    found = []
    for item, model in follows.items():
        serial = catalogue.serial_of(item)
        if serial is not None and catalogue.listing.model[serial] != model:
            found.append(_move(catalogue, serial, model))
    return found


def _move(catalogue: Catalogue, serial: int, model: str) -> Move:
    active = catalogue.listing.active[serial]
    return Move(serial, model, catalogue.shelf(serial).tags, active)


def _tables(
    store: Store, known: Revision, changed: Sequence[ItemModel], judged: Judged
) -> Sequence[Built]:
    """Tables of new versions: those of the gate, and what else policies look up."""
    wanted = needs(store, known)
    revision.rely_on_policies(store, known)
    index_coverage.check_usable(changed, wanted)
    others = [need for need in wanted if need.discount != judged.discount]
    return [*judged.tables, *index_coverage.of_new(store, changed, others)]
