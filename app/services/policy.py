"""The policy in force: swapped, kept in history, rolled back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain import PolicyVersion, Revision
from app.errors import Fault, InvalidRequest, NoEarlierPolicy
from app.services.live import find_policy
from app.services.policy_catalogue import complete
from app.storage import audit, policies, revision
from app.storage.store import Store

DEFAULT = "exact_rollout"


def current(store: Store) -> PolicyVersion:
    return find_policy(store, revision.current(store).policy)


@dataclass(frozen=True, slots=True)
class History:
    """Policies that were put in force, the latest first; and where the rest begins."""

    versions: Sequence[PolicyVersion]
    next: int | None


def history(store: Store, before: int, limit: int) -> History:
    found = policies.page(store, before, limit + 1)
    shown = found[:limit]
    return History(shown, shown[-1].version if len(found) > limit else None)


def ensure_one(store: Store) -> None:
    """Put the default policy in force where none ever was."""
    known = revision.current(store)
    if known.policy == 0:
        params = complete(DEFAULT, {})
        _activate(store, known, DEFAULT, params, "the default", "encore")


def swap(
    store: Store, name: str, params: Mapping[str, object], note: str, by: str
) -> PolicyVersion:
    """Put a policy in force; its name and parameters must be valid."""
    try:
        params = complete(name, params)
    except ValueError as error:
        field, _, message = str(error).partition(": ")
        fault = Fault(f"params.{field}", message)
        raise InvalidRequest(f"This is no policy: {error}.", fault) from error
    return _activate(store, revision.current(store), name, params, note, by)


def roll_back(store: Store, note: str, by: str) -> PolicyVersion:
    """Return to the policy before the one in force; again, to the one before that."""
    known = revision.current(store)
    present = find_policy(store, known.policy)
    origin = present.restores or present.version
    if origin <= 1:
        raise NoEarlierPolicy("The first policy is in force.")
    before = find_policy(store, origin - 1)
    restored = find_policy(store, before.restores or before.version)
    return _activate(
        store, known, restored.name, restored.params, note, by, restored.version
    )


def _activate(  # noqa: PLR0913, PLR0917 - the columns of a policy
    store: Store,
    known: Revision,
    name: str,
    params: Mapping[str, object],
    note: str,
    by: str,
    restores: int | None = None,
) -> PolicyVersion:
    now = datetime.now(UTC)
    version = revision.advance_policy(store, known)
    policy = PolicyVersion(version, name, params, note, now, by, restores)
    policies.insert(store, policy)
    audit.note(store, now, by, "policy", str(version), {"name": name, "note": note})
    return policy
