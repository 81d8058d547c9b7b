"""The policy in force: swapped, kept in history, rolled back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain import PolicyVersion, Revision
from app.errors import Fault, InvalidRequest, NoEarlierPolicy, NotReady
from app.services import index_coverage
from app.services.index_coverage import Coverage, Need
from app.services.live import find_policy
from app.services.policy_catalogue import complete, made
from app.storage import audit, policies, revision
from app.storage.store import Store
from policies import draws_samples

DEFAULT = "exact_rollout"
DISCOUNT = 0.95  # of the default
GUARD = "guard"  # puts policies in force, too, as if it were a key
WITHOUT_TABLES: Mapping[str, object] = {"base": "myopic", "horizon": 5, "leaf": "none"}


@dataclass(frozen=True, slots=True)
class Present:
    """The policy in force, and how far the index tables are that it needs, if any."""

    version: PolicyVersion
    tables: Coverage | None

    @property
    def warnings(self) -> Sequence[str]:
        return () if self.tables is None else self.tables.warnings


@dataclass(frozen=True, slots=True)
class History:
    """Policies that were put in force, the latest first; and where the rest begins."""

    versions: Sequence[PolicyVersion]
    next: int | None


def current(store: Store) -> Present:
    known = revision.current(store)
    found = find_policy(store, known.policy)
    tables = index_coverage.coverage(store, known, needed(found))
    return Present(found, tables)


def needed(version: PolicyVersion | None) -> Need | None:
    """The index tables that a policy needs, None if it needs none.

    None also for a policy that this release does not know, and cannot use.
    """
    try:
        policy = None if version is None else made(version)
    except NotReady:
        return None
    if policy is None or policy.table_discount is None:
        return None
    return Need(policy.table_discount, draws_samples(policy))


def need_in_force(store: Store, known: Revision) -> Need | None:
    return needed(policies.by_version(store, known.policy))


def history(store: Store, before: int, limit: int) -> History:
    found = policies.page(store, before, limit + 1)
    shown = found[:limit]
    return History(shown, shown[-1].version if len(found) > limit else None)


def ensure_one(store: Store) -> None:
    """Put the default policy in force where none ever was; see to its tables."""
    known = revision.current(store)
    if known.policy == 0:
        params, note = _first(store, known)
        _activate(store, known, DEFAULT, params, note, "encore")
    else:
        index_coverage.ensure(store, known, need_in_force(store, known))


def _first(store: Store, known: Revision) -> tuple[Mapping[str, object], str]:
    """Parameters of the first policy, and why: no tables where they cannot be had."""
    need = Need(DISCOUNT, by_sample=False)
    tables = index_coverage.coverage(store, known, need)
    if tables is not None and (tables.too_large or tables.sampled):
        return complete(
            DEFAULT, {**WITHOUT_TABLES, "discount": DISCOUNT}
        ), "the default for models so large"
    return complete(DEFAULT, {"discount": DISCOUNT}), "the default"


def swap(
    store: Store, name: str, params: Mapping[str, object], note: str, by: str
) -> Present:
    """Put a policy in force; its name and parameters must be valid."""
    try:
        params = complete(name, params)
    except ValueError as error:
        field, _, message = str(error).partition(": ")
        fault = Fault(f"params.{field}", message)
        raise InvalidRequest(f"This is no policy: {error}.", fault) from error
    return _usable(_activate(store, revision.current(store), name, params, note, by))


def roll_back(store: Store, note: str, by: str) -> Present:
    """Return to the policy before the one in force; again, to the one before that."""
    known = revision.current(store)
    present = find_policy(store, known.policy)
    origin = present.restores or present.version
    if origin <= 1:
        raise NoEarlierPolicy("The first policy is in force.")
    before = find_policy(store, origin - 1)
    restored = find_policy(store, before.restores or before.version)
    return _usable(
        _activate(
            store, known, restored.name, restored.params, note, by, restored.version
        )
    )


def fall_back(
    store: Store, known: Revision, name: str, params: Mapping[str, object], note: str
) -> Present:
    """Put a policy in force for the guard, if the one known is in force still."""
    return _usable(_activate(store, known, name, params, note, GUARD))


def put_back(store: Store, known: Revision, note: str) -> Present:
    """Undo the swap to the policy known, for the guard, if that is in force still."""
    before = find_policy(store, known.policy - 1)
    origin = before.restores or before.version
    return _usable(
        _activate(store, known, before.name, before.params, note, GUARD, origin)
    )


def has_fallen(present: PolicyVersion) -> bool:
    """Whether the guard has put this policy in place of another."""
    return present.by == GUARD and present.restores is None


def _activate(  # noqa: PLR0913, PLR0917 - the columns of a policy
    store: Store,
    known: Revision,
    name: str,
    params: Mapping[str, object],
    note: str,
    by: str,
    restores: int | None = None,
) -> Present:
    now = datetime.now(UTC)
    version = revision.advance_policy(store, known)
    policy = PolicyVersion(version, name, params, note, now, by, restores)
    policies.insert(store, policy)
    audit.note(store, now, by, "policy", str(version), {"name": name, "note": note})
    return Present(policy, index_coverage.ensure(store, known, needed(policy)))


def _usable(present: Present) -> Present:
    """Refuse a policy that could choose nothing."""
    if present.tables is not None:
        index_coverage.refuse(present.tables)
    return present
