"""Whether a model's index can be trusted, and how far its table is."""

from dataclasses import dataclass, replace
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

    target:   of all samples of the model, if it has any
    progress: share of the full table that is built
    table:    the finest one there is; of samples, the one that is least to be trusted
    """

    target: Target
    state: State
    progress: float
    table: TableRecord | None


def report(store: Store, model_id: str, discount: float | None) -> Report:
    """The report at a discount; None: at the one that is in use."""
    model = models.find(store, model_id, None)
    needs = index_builds.in_use(store, revision.current(store))
    worth = needs[0].discount if discount is None else discount
    target = Target(model.id, model.version, worth)
    tables = [*index_coverage.finest(store, [model], worth).values()]
    full = sum(table.precision is Precision.FULL for table in tables)
    table = max(tables, key=_doubt, default=None)
    if full == model.chains:
        return Report(target, State.READY, 1.0, table)
    samples = {replace(target, sample=sample) for sample in range(model.chains)}
    claims = index_builds.claims_of(store, samples)
    done = (full + sum(claim.progress for claim in claims)) / model.chains
    if claims:
        return Report(target, State.BUILDING, min(done, 1.0), table)
    wanted = any(
        worth == need.discount and index_coverage.usable(model, need) for need in needs
    )
    return Report(target, State.WAITING if wanted else State.NONE, done, table)


def _doubt(table: TableRecord) -> tuple[bool, int, float]:
    return table.precision is not Precision.FULL, table.unsettled, table.error
