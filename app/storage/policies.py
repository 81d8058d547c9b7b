"""Policies that were put in force, for all users or in an experiment, in order."""

from collections.abc import Sequence
from dataclasses import asdict

import sqlalchemy as sa

from app.domain import Described, PolicyVersion
from app.storage.prepared import Row
from app.storage.records import columns
from app.storage.store import Store
from app.storage.tables import policies

INSERT = policies.insert()
BY_VERSION = sa.select(policies).where(policies.c.version == sa.bindparam("version"))
EVERY = sa.select(policies)
LATEST = sa.select(sa.func.max(policies.c.version))
PAGE = (
    sa.select(policies)
    .where(policies.c.version < sa.bindparam("before"), policies.c.experiment.is_(None))
    .order_by(policies.c.version.desc())
    .limit(sa.bindparam("limit"))
)
AFTER = (
    sa.select(policies)
    .where(policies.c.version > sa.bindparam("after"), policies.c.experiment.is_(None))
    .order_by(policies.c.version)
)
SET_RUNGS = (
    policies.update()
    .where(policies.c.version == sa.bindparam("of"))
    .values(rungs=sa.bindparam("to_rungs"))
)


def insert(store: Store, policy: PolicyVersion) -> None:
    store.write(INSERT, columns(policy) | {"rungs": _plain(policy.rungs)})


def set_rungs(store: Store, version: int, rungs: Sequence[Described]) -> None:
    """Note what a version of an earlier release falls to."""
    store.write(SET_RUNGS, {"of": version, "to_rungs": _plain(rungs)})


def by_version(store: Store, version: int) -> PolicyVersion | None:
    row = store.row(BY_VERSION, {"version": version})
    return None if row is None else _policy(row)


def latest(store: Store) -> int:
    """The highest version there is, 0 if there is none."""
    row = store.row(LATEST)
    return 0 if row is None or row[0] is None else int(row[0])


def page(store: Store, before: int, limit: int) -> Sequence[PolicyVersion]:
    """Policies that were in force for all, before a version, the latest first."""
    rows = store.rows(PAGE, {"before": before, "limit": limit})
    return [_policy(row) for row in rows]


def after(store: Store, version: int) -> Sequence[PolicyVersion]:
    """Policies that were in force for all after a version, in order."""
    return [_policy(row) for row in store.rows(AFTER, {"after": version})]


def every(store: Store) -> Sequence[PolicyVersion]:
    """All policies that were ever put in force, also in experiments."""
    return [_policy(row) for row in store.rows(EVERY)]


def _plain(rungs: Sequence[Described] | None) -> list[dict[str, object]] | None:
    return None if rungs is None else [asdict(rung) for rung in rungs]


def _policy(row: Row) -> PolicyVersion:
    fields = row._asdict()
    if fields["rungs"] is not None:
        fields["rungs"] = [Described(**rung) for rung in fields["rungs"]]
    return PolicyVersion(**fields)
