"""Whether a model's index can be trusted, and how far its table is."""

from dataclasses import dataclass
from enum import StrEnum

from app.domain import Precision
from app.services import index_builds, index_coverage, models
from app.storage import revision
from app.storage.index_builds import Target
from app.storage.index_tables import TableRecord
from app.storage.store import Store
from policies import MOST_DISCOUNT

__all__ = ["MOST_DISCOUNT", "Report", "State", "report"]


class State(StrEnum):
    """What becomes of a full table."""

    NONE = "none"
    WAITING = "waiting"
    BUILDING = "building"
    READY = "ready"


@dataclass(frozen=True, slots=True)
class Report:
    """The index of the latest version of a model at a discount.

    progress: share of the full table that is built
    table:    the finest one there is
    """

    target: Target
    state: State
    progress: float
    table: TableRecord | None


def report(store: Store, model_id: str, discount: float | None) -> Report:
    """The report at a discount; None: at the one that is in use."""
    model = models.find(store, model_id, None)
    in_use = index_builds.discount_in_use(store, revision.current(store))
    target = Target(model.id, model.version, in_use if discount is None else discount)
    tables = index_coverage.finest(store, [model], target.discount)
    table = tables.get((model.id, model.version))
    if table is not None and table.precision is Precision.FULL:
        return Report(target, State.READY, 1.0, table)
    claim = index_builds.claim_of(store, target)
    if claim is not None:
        return Report(target, State.BUILDING, claim.progress, table)
    wanted = target.discount == in_use and index_coverage.is_small(model)
    return Report(target, State.WAITING if wanted else State.NONE, 0.0, table)
