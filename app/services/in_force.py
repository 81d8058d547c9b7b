"""Policies that were put in force, made ready to decide."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial

from app.domain import Described, Experiment, PolicyVersion, Revision
from app.errors import NotReady
from app.services import index_tables
from app.services.catalogue import Catalogue
from app.services.index_coverage import Need
from app.services.index_tables import NOTHING, AtHand
from app.services.pace import Pace
from app.services.policy_catalogue import made
from app.services.rungs import Rung, below, failing, policies_of, prepared
from app.storage import experiments, policies
from app.storage.index_tables import TableKey
from app.storage.store import Store
from policies import NO_TABLES, ModelSet, Policy, Tables, draws_samples

Paces = dict[tuple[int, int], Pace]
NO_VERSION = 0  # of a policy that was never in force


@dataclass(frozen=True, slots=True, eq=False)
class InForce:
    """A policy that is ready to decide for one set of models and their index tables.

    rungs:   the policy itself, and what decides where it takes too long or fails
    tables:  those of the catalogue it was made ready for
    at_hand: those that it looks scores up in, read and unpacked
    budget:  seconds that a decision may take
    """

    version: PolicyVersion
    rungs: Sequence[Rung]
    models: ModelSet
    tables: Sequence[TableKey]
    at_hand: AtHand
    budget: float = math.inf

    def is_ready_for(self, catalogue: Catalogue) -> bool:
        needs_tables = self.rungs[0].policy.table_discount is not None
        return self.models is catalogue.models and (
            self.tables is catalogue.tables or not needs_tables
        )


def find_policy(store: Store, version: int) -> PolicyVersion:
    found = policies.by_version(store, version)
    if found is None:
        raise NotReady("No policy is in force yet.")
    return found


def versions(known: Revision, experiment: Experiment | None) -> Sequence[int]:
    """Versions that are in force: for all, for arms, or in the shade."""
    return [known.policy, *(() if experiment is None else experiment.policies)]


def needs(store: Store, known: Revision) -> Sequence[Need]:
    """The index tables that policies in force need, each once."""
    experiment = experiments.by_version(store, known.experiment)
    found = (
        needed(policies.by_version(store, version))
        for version in versions(known, experiment)
    )
    return list(dict.fromkeys(need for need in found if need is not None))


def needed(described: Described | PolicyVersion | None) -> Need | None:
    """The index tables that a policy needs, None if it needs none.

    None also for a policy that this release does not know, and cannot use.
    """
    try:
        policy = None if described is None else made(described)
    except NotReady:
        return None
    if policy is None or policy.table_discount is None:
        return None
    return Need(policy.table_discount, draws_samples(policy))


def ready(
    store: Store, version: int, catalogue: Catalogue, kept: AtHand, paces: Paces
) -> InForce:
    """Make the rungs of a policy ready; those that lack their tables will fail.

    kept: index tables that need not be read again
    """
    return _made_ready(store, find_policy(store, version), catalogue, kept, paces)


def tried(
    store: Store, policy: Described, catalogue: Catalogue, kept: AtHand
) -> InForce:
    """Make a policy ready that is not in force: to plan with it, never to serve."""
    name, params = policy.name, policy.params
    lower = below(made(policy))
    version = PolicyVersion(NO_VERSION, name, params, "", datetime.now(UTC), "")
    return _made_ready(store, replace(version, rungs=lower), catalogue, kept, {})


def _made_ready(
    store: Store,
    found: PolicyVersion,
    catalogue: Catalogue,
    kept: AtHand,
    paces: Paces,
) -> InForce:
    stand = policies_of(found)
    at_hand, missing = NOTHING, None
    try:
        at_hand = index_tables.at_hand(store, catalogue, stand[0].table_discount, kept)
    except NotReady as error:
        missing = error
    own = [
        paces.setdefault((found.version, number), Pace())
        for number, _ in enumerate(stand)
    ]
    make = partial(_ready, stand, catalogue.models, at_hand, own, missing)
    rungs = store.aside(make)
    return InForce(found, rungs, catalogue.models, catalogue.tables, at_hand)


def rung(
    store: Store, version: int, number: int, catalogue: Catalogue, kept: AtHand
) -> Rung:
    """Make one rung of a policy ready, to decide again what it has decided."""
    policy = policies_of(find_policy(store, version))[number]
    at_hand = index_tables.at_hand(store, catalogue, policy.table_discount, kept)
    [made_ready] = store.aside(
        partial(_ready, [policy], catalogue.models, at_hand, [Pace()], None)
    )
    return made_ready


def _ready(
    stand: Sequence[Policy],
    models: ModelSet,
    at_hand: AtHand,
    paces: Sequence[Pace],
    missing: NotReady | None,
) -> Sequence[Rung]:
    tables = [*at_hand.values()]
    stacked = Tables.of(tables, tables[0].discount) if tables else NO_TABLES
    return [
        failing(policy, missing, pace)
        if missing is not None and policy.table_discount is not None
        else prepared(policy, models, stacked, pace)
        for policy, pace in zip(stand, paces, strict=True)
    ]
