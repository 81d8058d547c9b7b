"""What is in force in this process: the catalogue and the policy, kept up to date.

Every unit of work reads the revision together with the user's row. If it has moved, the
snapshot follows before anything is decided: so each worker obeys a change at once.
"""

import asyncio
from dataclasses import dataclass
from datetime import timedelta
from functools import partial

from app.domain import PolicyVersion, Revision
from app.errors import NotReady
from app.services.catalogue import Catalogue
from app.storage import items, models, policies, revision
from app.storage.store import Store
from policies import ModelSet, Policy, Scorer, create, ready


@dataclass(frozen=True, slots=True, eq=False)
class InForce:
    """A policy that is ready to decide for one set of models."""

    version: PolicyVersion
    policy: Policy
    models: ModelSet
    scorer: Scorer


class Live:
    """The latest catalogue and policy; each is replaced whole, never changed.

    pending_ttl: how long a play waits for its answer
    """

    def __init__(self, pending_ttl: timedelta) -> None:
        self.pending_ttl = pending_ttl
        self._catalogue = Catalogue.empty()
        self._following = asyncio.Lock()
        self._in_force: InForce | None = None
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
        if (
            current is None
            or current.version.version != known.policy
            or current.models is not catalogue.models
        ):
            current = self._in_force = load_policy(
                store, known.policy, catalogue.models
            )
        return current

    def version(self, store: Store, version: int) -> PolicyVersion:
        """A policy that is or was in force."""
        if version not in self._versions:
            self._versions[version] = find_policy(store, version)
        return self._versions[version]


def follow(store: Store, catalogue: Catalogue, known: Revision) -> Catalogue:
    """The catalogue of this revision or a later one, from what changed since."""
    while True:
        listing = catalogue.listing.copy()
        for item in items.changed(store, catalogue.version):
            listing.put_item(item)
        versions = models.at(store, known.catalogue)
        now = revision.current(store)
        if now.catalogue == known.catalogue:
            build = partial(catalogue.followed_by, known, versions, listing)
            return store.aside(build)
        known = now


def load_policy(store: Store, version: int, models: ModelSet) -> InForce:
    """A policy that was put in force, made ready for these models."""
    found = find_policy(store, version)
    try:
        policy = create(found.name, found.params)
    except ValueError as error:
        raise NotReady(f"This release has no such policy: {error}.") from error
    return InForce(found, policy, models, ready(policy, models))


def find_policy(store: Store, version: int) -> PolicyVersion:
    found = policies.by_version(store, version)
    if found is None:
        raise NotReady("No policy is in force yet.")
    return found
