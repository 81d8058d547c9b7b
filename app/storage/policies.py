"""Policies that were put in force, in order."""

from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa

from app.domain import PolicyVersion
from app.storage.records import columns
from app.storage.store import Store
from app.storage.tables import policies

INSERT = policies.insert()
BY_VERSION = sa.select(policies).where(policies.c.version == sa.bindparam("version"))
EVERY = sa.select(policies)
PAGE = (
    sa.select(policies)
    .where(policies.c.version < sa.bindparam("before"))
    .order_by(policies.c.version.desc())
    .limit(sa.bindparam("limit"))
)


def insert(store: Store, policy: PolicyVersion) -> None:
    store.write(INSERT, columns(policy))


def by_version(store: Store, version: int) -> PolicyVersion | None:
    row = store.row(BY_VERSION, {"version": version})
    return None if row is None else _policy(row)


def page(store: Store, before: int, limit: int) -> Sequence[PolicyVersion]:
    """Policies before a version, the latest first."""
    rows = store.rows(PAGE, {"before": before, "limit": limit})
    return [_policy(row) for row in rows]


def every(store: Store) -> Sequence[PolicyVersion]:
    """All policies that were ever put in force."""
    return [_policy(row) for row in store.rows(EVERY)]


def _policy(row: sa.Row[Any]) -> PolicyVersion:
    return PolicyVersion(**row._mapping)  # noqa: SLF001 - its public name in SQLAlchemy
