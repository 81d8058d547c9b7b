"""What is in force in this process: the catalogue and the policy, kept up to date.

Every unit of work reads the revision together with the user's row. If it has moved, the
snapshot follows before anything is decided: so each worker obeys a change at once.
"""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from functools import partial

from app.domain import PolicyVersion, Revision
from app.errors import NotReady
from app.services import index_tables
from app.services.catalogue import Catalogue
from app.services.index_tables import NOTHING, AtHand
from app.services.policy_catalogue import made
from app.storage import index_tables as stored
from app.storage import items, models, policies, revision
from app.storage.index_tables import TableKey
from app.storage.store import Store
from policies import ModelSet, Policy, Scorer, Tables


@dataclass(frozen=True, slots=True, eq=False)
class InForce:
    """A policy that is ready to decide for one set of models and their index tables.

    tables:  those of the catalogue it was made ready for
    at_hand: those that it looks scores up in, read and unpacked
    """

    version: PolicyVersion
    policy: Policy
    models: ModelSet
    tables: Sequence[TableKey]
    at_hand: AtHand
    scorer: Scorer

    def is_ready_for(self, version: int, catalogue: Catalogue) -> bool:
        return (
            self.version.version == version
            and self.models is catalogue.models
            and (not self.at_hand or self.tables is catalogue.tables)
        )


class Live:
    """The latest catalogue and policy; each is replaced whole, never changed.

    pending_ttl: how long a play waits for its answer
    """

    def __init__(self, pending_ttl: timedelta) -> None:
        self.pending_ttl = pending_ttl
        self._catalogue = Catalogue.empty()
        self._following = asyncio.Lock()
        self._in_force: InForce | None = None
        self._loading = asyncio.Lock()
        self._versions: dict[int, PolicyVersion] = {}

    def catalogue(self, store: Store, known: Revision) -> Catalogue:
        """The catalogue of this revision, or of a later one."""
        if self._catalogue.version < known.catalogue:
            with store.alone(self._following):
                if self._catalogue.version < known.catalogue:
                    self._catalogue = follow(store, self._catalogue, known)
        return self._catalogue

    def policy(self, store: Store, known: Revision, catalogue: Catalogue) -> InForce:
        """The policy of this revision, ready for the models of this catalogue."""
        current = self._in_force
        if current is None or not current.is_ready_for(known.policy, catalogue):
            with store.alone(self._loading):
                current = self._in_force
                if current is None or not current.is_ready_for(known.policy, catalogue):
                    current = self.load(store, known.policy, catalogue)
                    self._in_force = current
        return current

    def load(self, store: Store, version: int, catalogue: Catalogue) -> InForce:
        """A policy that is or was in force, made ready for a catalogue."""
        kept = NOTHING if self._in_force is None else self._in_force.at_hand
        return load_policy(store, version, catalogue, kept)

    def version(self, store: Store, version: int) -> PolicyVersion:
        """A policy that is or was in force."""
        if version not in self._versions:
            self._versions[version] = find_policy(store, version)
        return self._versions[version]


def follow(store: Store, catalogue: Catalogue, known: Revision) -> Catalogue:
    """The catalogue of this revision or a later one, from what changed since."""
    while True:
        listing = catalogue.listing
        for item in items.changed(store, catalogue.version):
            listing = listing.copy() if listing is catalogue.listing else listing
            listing.put_item(item)
        versions = models.at(store, known.catalogue)
        published = stored.published(store, catalogue.version, known.catalogue)
        tables = index_tables.followed(catalogue.tables, published, versions)
        now = revision.current(store)
        if now.catalogue == known.catalogue:
            build = partial(catalogue.followed_by, known, versions, tables, listing)
            return store.aside(build)
        known = now


def load_policy(
    store: Store, version: int, catalogue: Catalogue, kept: AtHand = NOTHING
) -> InForce:
    """A policy that was put in force, made ready for a catalogue.

    kept: index tables that need not be read again
    """
    found = find_policy(store, version)
    policy = made(found)
    at_hand = index_tables.at_hand(store, catalogue, policy.table_discount, kept)
    scorer = store.aside(partial(_prepared, policy, catalogue.models, at_hand))
    tables = catalogue.tables
    return InForce(found, policy, catalogue.models, tables, at_hand, scorer)


def _prepared(policy: Policy, models: ModelSet, at_hand: AtHand) -> Scorer:
    discount = policy.table_discount or 0.0
    return policy.prepare(models, Tables.of([*at_hand.values()], discount))


def find_policy(store: Store, version: int) -> PolicyVersion:
    found = policies.by_version(store, version)
    if found is None:
        raise NotReady("No policy is in force yet.")
    return found
