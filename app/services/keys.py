"""Keys: made once, shown once, kept as a hash, checked in constant time."""

import hashlib
import hmac
import secrets
import time
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from functools import partial

from app.domain import Key, Scope
from app.errors import Forbidden, KeyNotFound, LastAdminKey, Unauthorized
from app.storage import audit, keys, revision
from app.storage.database import Database
from app.storage.store import Store

FRESH = 1.0  # seconds for which a key that was good is not looked up again
MOST_CACHED = 10_000
ONLY = "Make another admin key first."


def digest(secret: str) -> bytes:
    """Secrets are long and random, so a fast hash keeps them safe."""
    return hashlib.sha256(secret.encode(errors="surrogateescape")).digest()


def create(
    store: Store, scope: Scope, name: str, by: str, origins: Sequence[str] = ()
) -> tuple[Key, str]:
    """A new key, and its secret, which is not kept."""
    secret = f"encore_{secrets.token_urlsafe(32)}"
    return _enter(store, secret, scope, name, by, origins), secret


def rotate(store: Store, key_id: str, grace: timedelta, by: str) -> tuple[Key, str]:
    """A new key in place of one, which is good for a grace period still."""
    found = _find(store, key_id)
    now = datetime.now(UTC)
    end = now + grace
    if found.expires_at is None or found.expires_at > end:
        keys.expire(store, key_id, end)
    audit.note(store, now, by, "rotate_key", key_id, {"until": end.isoformat()})
    return create(store, found.scope, found.name, by, found.origins)


def ensure(store: Store, secret: str, scope: Scope, name: str) -> None:
    """Make a key whose secret is known in advance, unless it was ever made."""
    if keys.by_digest(store, digest(secret)) is None:
        _enter(store, secret, scope, name, by="settings")


def in_force(store: Store) -> Sequence[Key]:
    return keys.in_force(store, datetime.now(UTC))


def revoke(store: Store, key_id: str, by: str) -> None:
    """End a key; the last one that can administer stays."""
    found = _find(store, key_id)
    if found.scope is Scope.ADMIN and not any(
        key.scope is Scope.ADMIN and key.expires_at is None and key.id != key_id
        for key in in_force(store)
    ):
        raise LastAdminKey(ONLY)
    now = datetime.now(UTC)
    policy_now = revision.current(store).policy
    store.rely_on_revision("policy", policy_now)  # one key at a time
    keys.revoke(store, key_id, now)
    audit.note(store, now, by, "revoke_key", key_id)


def ensure_revoked(store: Store, key_id: str) -> None:
    """Tell if a key outlived its revocation, as another one came before it."""
    if any(key.id == key_id for key in in_force(store)):
        raise LastAdminKey(ONLY)


class KeyRing:
    """Keys that were seen lately, so that few requests look one up.

    A key that is revoked is refused by every process within a second.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._seen: dict[bytes, tuple[float, Key]] = {}
        self._origins: tuple[float, frozenset[str]] = (-FRESH, frozenset())

    async def check(self, secret: str, scope: Scope) -> Key:
        """The key of this secret, if it allows the scope."""
        key = await self._find(digest(secret))
        if key is None or key.revoked_at is not None or _has_expired(key):
            raise Unauthorized("The key is not known.")
        if scope is Scope.ADMIN and key.scope is not Scope.ADMIN:
            raise Forbidden(f"A key of scope {scope} is needed, not {key.scope}.")
        return key

    def forget(self) -> None:
        self._seen.clear()

    async def knows_origin(self, origin: str) -> bool:
        """Whether any key is for pages of an origin."""
        looked, found = self._origins
        now = time.monotonic()
        if now - looked >= FRESH:
            present = await self._database.run(in_force)
            found = frozenset(origin for key in present for origin in key.origins)
            self._origins = now, found
        return origin in found

    async def _find(self, wanted: bytes) -> Key | None:
        seen = self._seen.get(wanted)
        now = time.monotonic()
        if seen is not None and now - seen[0] < FRESH:
            return seen[1]
        key = await self._database.run(partial(keys.by_digest, digest=wanted))
        if key is None or not hmac.compare_digest(key.digest, wanted):
            return None
        if len(self._seen) >= MOST_CACHED:
            self._seen.clear()
        self._seen[wanted] = (now, key)
        return key


def _has_expired(key: Key) -> bool:
    return key.expires_at is not None and key.expires_at <= datetime.now(UTC)


def _find(store: Store, key_id: str) -> Key:
    for key in in_force(store):
        if key.id == key_id:
            return key
    raise KeyNotFound(key_id)


def _enter(
    store: Store,
    secret: str,
    scope: Scope,
    name: str,
    by: str,
    origins: Sequence[str] = (),
) -> Key:
    now = datetime.now(UTC)
    key = Key(
        id=secrets.token_hex(8),
        digest=digest(secret),
        scope=scope,
        name=name,
        created_at=now,
        origins=tuple(origins),
    )
    keys.insert(store, key)
    detail = {"scope": scope, "name": name, "origins": key.origins}
    audit.note(store, now, by, "create_key", key.id, detail)
    return key
