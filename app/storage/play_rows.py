"""A play as a row of its table, and back."""

from collections.abc import Mapping, Sequence

from app.domain import EVERYTHING, Play, Selection, Source
from app.storage.prepared import Row


def to_row(play: Play) -> Mapping[str, object]:
    chosen_from = play.selection
    return {
        "user_id": play.user,
        "id": play.id,
        "slate": play.slate,
        "place": play.place,
        "item": play.item,
        "slot": play.slot,
        "closed": play.closed,
        "source": play.source.value,
        "policy": play.policy,
        "catalogue": play.catalogue,
        "model": play.model,
        "model_version": play.model_version,
        "seed": play.seed,
        "selection": None if chosen_from.is_everything else _plain(chosen_from),
        "predicted": play.predicted,
        "propensity": play.propensity,
        "created_at": play.created_at,
        "signal": play.signal,
        "fraction": play.fraction,
        "answered_at": play.answered_at,
        "idempotency_key": play.idempotency_key,
        "experiment": play.experiment,
        "arm": play.arm,
        "rung": play.rung,
    }


def from_row(row: Row) -> Play:
    return Play(
        id=row.id,
        slate=row.slate,
        place=row.place,
        user=row.user_id,
        item=row.item,
        slot=row.slot,
        closed=row.closed,
        source=Source(row.source),
        policy=row.policy,
        catalogue=row.catalogue,
        model=row.model,
        model_version=row.model_version,
        seed=row.seed,
        selection=_selection(row.selection),
        predicted=row.predicted,
        propensity=row.propensity,
        created_at=row.created_at,
        signal=row.signal,
        fraction=row.fraction,
        answered_at=row.answered_at,
        idempotency_key=row.idempotency_key,
        experiment=row.experiment,
        arm=row.arm,
        rung=row.rung,
    )


def _plain(selection: Selection) -> dict[str, object]:
    return {
        "tags": selection.tags,
        "candidates": selection.candidates,
        "excluded": selection.excluded,
    }


def _selection(plain: Mapping[str, Sequence[str] | None] | None) -> Selection:
    if plain is None:
        return EVERYTHING
    candidates = plain["candidates"]
    return Selection(
        tags=tuple(plain["tags"] or ()),
        candidates=None if candidates is None else tuple(candidates),
        excluded=tuple(plain["excluded"] or ()),
    )
