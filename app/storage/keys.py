"""Keys, kept as the SHA-256 of their secret."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa

from app.domain import Key, Scope
from app.storage.prepared import Row
from app.storage.store import Store
from app.storage.tables import Instant, keys

INSERT = sa.text(  # several workers may make the key of the settings at once
    "INSERT INTO keys (id, digest, scope, name, created_at, origins)"
    " VALUES (:id, :digest, :scope, :name, :created_at, :origins)"
    " ON CONFLICT (digest) DO NOTHING"
).bindparams(
    sa.bindparam("created_at", type_=Instant),
    sa.bindparam("origins", type_=keys.c.origins.type),
)
OTHER = keys.alias()
OTHER_ADMIN = sa.exists().where(
    OTHER.c.scope == Scope.ADMIN.value,
    OTHER.c.revoked_at.is_(None),
    OTHER.c.expires_at.is_(None),
    OTHER.c.id != keys.c.id,
)
REVOKE = (
    keys.update()
    .where(keys.c.id == sa.bindparam("key"))
    .where(sa.or_(keys.c.scope != Scope.ADMIN.value, OTHER_ADMIN))
    .values(revoked_at=sa.bindparam("at"))
)
EXPIRE = (
    keys.update()
    .where(keys.c.id == sa.bindparam("key"), keys.c.revoked_at.is_(None))
    .values(expires_at=sa.bindparam("at"))
)
BY_DIGEST = sa.select(keys).where(keys.c.digest == sa.bindparam("digest"))
IN_FORCE = (
    sa.select(keys)
    .where(keys.c.revoked_at.is_(None))
    .where(sa.or_(keys.c.expires_at.is_(None), keys.c.expires_at > sa.bindparam("now")))
    .order_by(keys.c.id)
)


def insert(store: Store, key: Key) -> None:
    store.write(
        INSERT,
        {
            "id": key.id,
            "digest": key.digest,
            "scope": key.scope.value,
            "name": key.name,
            "created_at": key.created_at,
            "origins": [*key.origins] or None,
        },
    )


def revoke(store: Store, key: str, at: datetime) -> None:
    """Revoke a key, unless it is the last that can administer."""
    store.write(REVOKE, {"key": key, "at": at})


def expire(store: Store, key: str, at: datetime) -> None:
    """Let a key end at a moment."""
    store.write(EXPIRE, {"key": key, "at": at})


def by_digest(store: Store, digest: bytes) -> Key | None:
    row = store.row(BY_DIGEST, {"digest": digest})
    return None if row is None else _key(row)


def in_force(store: Store, now: datetime) -> Sequence[Key]:
    return [_key(row) for row in store.rows(IN_FORCE, {"now": now})]


def _key(row: Row) -> Key:
    return Key(
        id=row.id,
        digest=row.digest,
        scope=Scope(row.scope),
        name=row.name,
        created_at=row.created_at,
        revoked_at=row.revoked_at,
        expires_at=row.expires_at,
        origins=tuple(row.origins or ()),
    )
