"""What is in force in this process: catalogue, policies, experiment; kept up to date.

Every unit of work reads the revision together with the user's row. If it has moved, the
snapshot follows before anything is decided: so each worker obeys a change at once.
"""

import asyncio
import json
import math
from dataclasses import replace
from datetime import timedelta
from functools import partial

from app.domain import Described, Experiment, PolicyVersion, Revision
from app.services import in_force, index_tables
from app.services.catalogue import Catalogue
from app.services.in_force import InForce, Paces
from app.services.index_tables import AtHand
from app.services.rungs import Rung
from app.storage import experiments, items, models, revision
from app.storage import index_tables as stored
from app.storage.store import Store

MOST_TRIED = 4


class Live:
    """The latest catalogue and policies; each is replaced whole, never changed.

    pending_ttl: how long a play waits for its answer
    budget:      seconds that a decision may take
    """

    def __init__(self, pending_ttl: timedelta, budget: float = math.inf) -> None:
        self.pending_ttl = pending_ttl
        self._budget = budget
        self._catalogue = Catalogue.empty()
        self._following = asyncio.Lock()
        self._in_force: dict[int, InForce] = {}
        self._loading = asyncio.Lock()
        self._tried: dict[str, InForce] = {}
        self._paces: Paces = {}
        self._versions: dict[int, PolicyVersion] = {}
        self._experiment: tuple[int, Experiment | None] = (0, None)

    def catalogue(self, store: Store, known: Revision) -> Catalogue:
        """The catalogue of this revision, or of a later one."""
        if self._catalogue.version < known.catalogue:
            with store.alone(self._following):
                if self._catalogue.version < known.catalogue:
                    self._catalogue = follow(store, self._catalogue, known)
        return self._catalogue

    def experiment(self, store: Store, known: Revision) -> Experiment | None:
        """The experiment of this revision, None if none runs."""
        version, found = self._experiment
        if version != known.experiment:
            found = experiments.by_version(store, known.experiment)
            self._experiment = known.experiment, found
        return found

    def policy(
        self,
        store: Store,
        known: Revision,
        catalogue: Catalogue,
        version: int | None = None,
    ) -> InForce:
        """A policy that is in force, ready for the models of this catalogue.

        version: None: the one for all users
        """
        version = known.policy if version is None else version
        current = self._in_force.get(version)
        if current is None or not current.is_ready_for(catalogue):
            with store.alone(self._loading):
                current = self._in_force.get(version)
                if current is None or not current.is_ready_for(catalogue):
                    current = self._load(store, known, catalogue, version)
        return current

    def tried(self, store: Store, catalogue: Catalogue, policy: Described) -> InForce:
        """A policy that is not in force, ready to plan with; the last few are kept."""
        key = json.dumps([policy.name, policy.params], sort_keys=True)
        found = self._tried.pop(key, None)
        if found is None or not found.is_ready_for(catalogue):
            found = in_force.tried(store, policy, catalogue, self._at_hand())
            found = replace(found, budget=self._budget)
        self._tried[key] = found
        while len(self._tried) > MOST_TRIED:
            del self._tried[next(iter(self._tried))]
        return found

    def rung(
        self, store: Store, version: int, number: int, catalogue: Catalogue
    ) -> Rung:
        """A rung of a policy that is or was in force, made ready for a catalogue."""
        return in_force.rung(store, version, number, catalogue, self._at_hand())

    def version(self, store: Store, version: int) -> PolicyVersion:
        """A policy that is or was in force."""
        if version not in self._versions:
            self._versions[version] = in_force.find_policy(store, version)
        return self._versions[version]

    def _load(
        self, store: Store, known: Revision, catalogue: Catalogue, version: int
    ) -> InForce:
        """Make a policy ready, and let go of those that are in force no more."""
        kept, experiment = self._at_hand(), self.experiment(store, known)
        found = in_force.ready(store, version, catalogue, kept, self._paces)
        found = replace(found, budget=self._budget)
        others = {*in_force.versions(known, experiment)} & self._in_force.keys()
        self._in_force = {one: self._in_force[one] for one in others}
        self._in_force[version] = found
        return found

    def tables(self, store: Store, catalogue: Catalogue, discount: float) -> AtHand:
        """The index tables of this catalogue.

        Raises:
            NotReady: a model has none at this discount.
        """
        return index_tables.at_hand(store, catalogue, discount, self._at_hand())

    def _at_hand(self) -> AtHand:
        return {
            key: table
            for policy in self._in_force.values()
            for key, table in policy.at_hand.items()
        }


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
