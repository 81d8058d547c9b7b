"""Experiments, which split users between policies: each change of one is a version."""

from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime

import sqlalchemy as sa

from app.domain import Arm, Experiment, Shadow
from app.storage.prepared import Row
from app.storage.records import columns
from app.storage.store import Store
from app.storage.tables import experiments

LATEST = 2**31 - 1  # no version is as high

INSERT = experiments.insert()
BY_VERSION = sa.select(experiments).where(
    experiments.c.version == sa.bindparam("version")
)
END = (
    experiments.update()
    .where(experiments.c.version == sa.bindparam("of"))
    .values(
        ended_at=sa.bindparam("to_at"),
        ended_by=sa.bindparam("to_by"),
        ended_note=sa.bindparam("to_note"),
    )
)
PAGE = (
    sa.select(experiments)
    .where(experiments.c.version < sa.bindparam("before"))
    .order_by(experiments.c.version.desc())
    .limit(sa.bindparam("limit"))
)
VERSIONS = (
    sa.select(experiments)
    .where(experiments.c.origin == sa.bindparam("origin"))
    .order_by(experiments.c.version)
)


def insert(store: Store, experiment: Experiment) -> None:
    plain = {
        "arms": [asdict(arm) for arm in experiment.arms],
        "shadows": [asdict(shadow) for shadow in experiment.shadows],
    }
    store.write(INSERT, columns(experiment) | plain)


def end(store: Store, version: int, at: datetime, by: str, note: str) -> None:
    """Note that a version has ended."""
    given = {"of": version, "to_at": at, "to_by": by, "to_note": note}
    store.write(END, given)


def by_version(store: Store, version: int) -> Experiment | None:
    """A version; None where one ended, and none has begun since."""
    row = store.row(BY_VERSION, {"version": version})
    return None if row is None else _experiment(row)


def page(store: Store, before: int, limit: int) -> Sequence[Experiment]:
    """Versions before another, the latest first."""
    rows = store.rows(PAGE, {"before": before, "limit": limit})
    return [_experiment(row) for row in rows]


def versions(store: Store, origin: int) -> Sequence[Experiment]:
    """All versions of one experiment, in order."""
    return [_experiment(row) for row in store.rows(VERSIONS, {"origin": origin})]


def _experiment(row: Row) -> Experiment:
    fields = row._asdict()
    fields["arms"] = [Arm(**arm) for arm in fields["arms"]]
    fields["shadows"] = [Shadow(**shadow) for shadow in fields["shadows"]]
    fields["split"] = [(end, name) for end, name in fields["split"]]
    return Experiment(**fields)
