"""The policy in force: swapped, kept in history, rolled back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain import GUARD, Described, PolicyVersion, Revision
from app.errors import NoEarlierPolicy, NotReady
from app.services import index_coverage, rungs
from app.services.in_force import find_policy, needed, needs
from app.services.index_coverage import Coverage, Need
from app.services.policy_catalogue import checked, complete, made
from app.storage import audit, policies, revision
from app.storage.store import Store
from policies import create

DEFAULT = "exact_rollout"
DISCOUNT = 0.95  # of the default
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
        return
    present = policies.by_version(store, known.policy)
    if present is not None and present.rungs is None:
        _complete(store, present)
    index_coverage.ensure(store, known, needs(store, known))


def _complete(store: Store, present: PolicyVersion) -> None:
    """Say what a policy falls to that an earlier release put in force."""
    try:
        below = rungs.below(made(present))
    except NotReady:
        return  # this release does not know it, and cannot use it
    policies.set_rungs(store, present.version, below)


def _first(store: Store, known: Revision) -> tuple[Mapping[str, object], str]:
    """Parameters of the first policy, and why: no tables where they cannot be had."""
    need = Need(DISCOUNT, by_sample=False)
    tables = index_coverage.coverage(store, known, need)
    if tables is not None and (tables.too_large or tables.sampled):
        return complete(
            DEFAULT, {**WITHOUT_TABLES, "discount": DISCOUNT}
        ), "the default for models so large"
    return complete(DEFAULT, {"discount": DISCOUNT}), "the default"


def swap(store: Store, described: Described, note: str, by: str) -> Present:
    """Put a policy in force."""
    name, params = described.name, checked(described).params
    return _usable(_activate(store, revision.current(store), name, params, note, by))


def roll_back(store: Store, note: str, by: str) -> Present:
    """Return to the policy before the one in force; again, to the one before that."""
    known = revision.current(store)
    present = find_policy(store, known.policy)
    origin = present.restores or present.version
    before = find_before(store, origin)
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
    before = find_before(store, known.policy)
    origin = before.restores or before.version
    return _usable(
        _activate(store, known, before.name, before.params, note, GUARD, origin)
    )


def find_before(store: Store, version: int) -> PolicyVersion:
    """The policy that was in force for all before another one."""
    found = policies.page(store, version, 1)
    if not found:
        raise NoEarlierPolicy("The first policy is in force.")
    return found[0]


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
    version = policies.latest(store) + 1
    policy = PolicyVersion(
        version, name, params, note, now, by, restores, None, _below(name, params)
    )
    revision.advance_policy(store, known, version)
    policies.insert(store, policy)
    audit.note(store, now, by, "policy", str(version), {"name": name, "note": note})
    need = needed(policy)
    [*tables] = index_coverage.ensure(store, known, () if need is None else (need,))
    return Present(policy, tables[0] if tables else None)


def _below(name: str, params: Mapping[str, object]) -> Sequence[Described]:
    return rungs.below(create(name, params))


def _usable(present: Present) -> Present:
    """Refuse a policy that could choose nothing."""
    if present.tables is not None:
        index_coverage.refuse(present.tables)
    return present
