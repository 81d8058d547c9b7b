"""Which index tables are being built, by whom: claims, which lapse if not renewed."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from app.storage.prepared import Row
from app.storage.store import Store
from app.storage.tables import Instant, index_builds


@dataclass(frozen=True, slots=True)
class Target:
    """A table that is wanted: of a model's version, or of its sample, at a discount."""

    model: str
    version: int
    discount: float
    sample: int = 0


@dataclass(frozen=True, slots=True)
class Claim:
    """Who builds a table, and how far it is, from 0 to 1."""

    target: Target
    worker: str
    renewed_at: datetime
    progress: float


THIS = sa.and_(
    index_builds.c.model == sa.bindparam("of"),
    index_builds.c.version == sa.bindparam("in_version"),
    index_builds.c.discount == sa.bindparam("at_discount"),
    index_builds.c.sample == sa.bindparam("of_sample"),
)
CLAIM = sa.text(  # of several workers that claim at once, the first has it
    "INSERT INTO index_builds"
    " (model, version, discount, sample, worker, renewed_at, progress)"
    " VALUES (:model, :version, :discount, :sample, :worker, :now, 0)"
    " ON CONFLICT (model, version, discount, sample)"
    " DO UPDATE SET worker = excluded.worker,"
    " renewed_at = excluded.renewed_at, progress = 0"
    " WHERE index_builds.renewed_at < :lapsed"
).bindparams(sa.bindparam("now", type_=Instant), sa.bindparam("lapsed", type_=Instant))
RENEW = (
    index_builds.update()
    .where(THIS, index_builds.c.worker == sa.bindparam("by"))
    .values(renewed_at=sa.bindparam("now"), progress=sa.bindparam("done"))
)
END = index_builds.delete().where(THIS)
RELEASE = index_builds.delete().where(index_builds.c.worker == sa.bindparam("by"))
FORGET = index_builds.delete().where(index_builds.c.renewed_at < sa.bindparam("lapsed"))
SINCE = sa.select(index_builds).where(
    index_builds.c.renewed_at >= sa.bindparam("lapsed")
)


def claim(
    store: Store, target: Target, worker: str, *, now: datetime, lapsed: datetime
) -> None:
    """Note a claim, which is taken only if no other holds that was renewed since."""
    store.write(
        CLAIM,
        {
            "model": target.model,
            "version": target.version,
            "discount": target.discount,
            "sample": target.sample,
            "worker": worker,
            "now": now,
            "lapsed": lapsed,
        },
    )


def renew(
    store: Store, target: Target, worker: str, *, now: datetime, progress: float
) -> None:
    store.write(RENEW, {**_this(target), "by": worker, "now": now, "done": progress})


def end(store: Store, target: Target) -> None:
    """End a claim, whoever holds it."""
    store.write(END, _this(target))


def release(store: Store, worker: str) -> None:
    """End all claims of a worker."""
    store.write(RELEASE, {"by": worker})


def forget(store: Store, *, lapsed: datetime) -> None:
    """End the claims that were not renewed since."""
    store.write(FORGET, {"lapsed": lapsed})


def standing(store: Store, *, lapsed: datetime) -> Sequence[Claim]:
    """The claims that were renewed since."""
    return [_claim(row) for row in store.rows(SINCE, {"lapsed": lapsed})]


def _this(target: Target) -> dict[str, object]:
    return {
        "of": target.model,
        "in_version": target.version,
        "at_discount": target.discount,
        "of_sample": target.sample,
    }


def _claim(row: Row) -> Claim:
    target = Target(row.model, row.version, row.discount, row.sample)
    return Claim(target, row.worker, row.renewed_at, row.progress)
