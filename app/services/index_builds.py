"""Full index tables, built in the background: who builds which, and their publication.

Several processes share the work by claims in the database, which lapse when the one
that holds them has not renewed them for a while.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from app.domain import ItemModel, Precision, Revision
from app.errors import NotReady
from app.services import index_coverage, index_tables
from app.services.in_force import needs
from app.services.index_coverage import Need, usable
from app.services.index_tables import Built
from app.services.policy import DISCOUNT
from app.services.policy_catalogue import made
from app.storage import index_builds, models, policies, revision
from app.storage import index_tables as stored
from app.storage.index_builds import Claim, Target
from app.storage.index_tables import TableKey
from app.storage.store import Store

LEASE = timedelta(seconds=30)


@dataclass(frozen=True, slots=True)
class Job:
    """A table to build."""

    target: Target
    model: ItemModel


@dataclass(frozen=True, slots=True)
class Look:
    """What there is to do.

    known:   when this was seen
    waiting: tables that are not there yet
    job:     one of them that nobody has claimed; claimed now
    """

    known: Revision
    waiting: int
    job: Job | None


def in_use(store: Store, known: Revision) -> Sequence[Need]:
    """The full tables that are wanted; those of the default if none are needed."""
    return needs(store, known) or (Need(DISCOUNT, by_sample=False),)


def claim(
    store: Store, worker: str, held: Collection[Target], but: Collection[Target]
) -> Look:
    """Claim a table that is wanted; `is_ours` tells whether that succeeded.

    held: tables that this worker has built and not yet published
    but:  tables that it cannot build
    """
    renew(store, worker, dict.fromkeys(held, 1.0))
    known = revision.current(store)
    wanted = _wanted(store, known)
    now = datetime.now(UTC)
    claims = index_builds.standing(store, lapsed=now - LEASE)
    taken = {*held, *but, *(claim.target for claim in claims)}
    for job in wanted:
        if job.target not in taken:
            index_builds.claim(store, job.target, worker, now=now, lapsed=now - LEASE)
            return Look(known, len(wanted), job)
    return Look(known, len(wanted), None)


def is_ours(store: Store, worker: str, target: Target) -> bool:
    """Whether a worker is to build a table that it claimed: of several, one is.

    A table that was published while it was claimed is there: then the claim ends.
    """
    if worker not in {claim.worker for claim in claims_of(store, [target])}:
        return False
    place = target.model, target.version, target.discount
    key = TableKey(*place, Precision.FULL, target.sample)
    if key not in stored.keys(store):
        return True
    index_builds.end(store, target)
    return False


def claims_of(store: Store, targets: Collection[Target]) -> Sequence[Claim]:
    """The claims of tables that are being built, or were built and not yet stored."""
    claims = index_builds.standing(store, lapsed=datetime.now(UTC) - LEASE)
    return [claim for claim in claims if claim.target in targets]


def renew(store: Store, worker: str, targets: Mapping[Target, float]) -> None:
    """Keep a worker's claims, and tell how far each table is."""
    now = datetime.now(UTC)
    for target, progress in targets.items():
        index_builds.renew(store, target, worker, now=now, progress=progress)


def release(store: Store, worker: str) -> None:
    """Leave what a worker has claimed to others."""
    index_builds.release(store, worker)


def publish(store: Store, built: Sequence[Built]) -> None:
    """Store tables, to be used from the next catalogue on; end their claims."""
    known = revision.current(store)
    versions = models.at(store, known.catalogue)
    present = {(model.id, model.version) for model in versions}
    there = set(stored.keys(store))
    new = [
        table
        for table in built
        if (table.record.model, table.record.version) in present
        and table.record.key not in there
    ]
    if new:
        catalogue = revision.advance_catalogue(store, known, new_epoch=False)
        index_tables.insert(store, new, catalogue)
    for table in built:
        index_builds.end(store, target_of(table))
    index_builds.forget(store, lapsed=datetime.now(UTC) - LEASE)
    _drop(store, (key for key in there if (key.model, key.version) not in present))


def target_of(built: Built) -> Target:
    record = built.record
    return Target(record.model, record.version, record.discount, record.sample)


def _wanted(store: Store, known: Revision) -> Sequence[Job]:
    versions = models.at(store, known.catalogue)
    jobs: dict[Target, Job] = {}
    for need in in_use(store, known):
        found = index_coverage.finest(store, versions, need.discount)
        ready = {
            place
            for place, record in found.items()
            if record.precision is Precision.FULL
        }
        for model in versions:
            for sample in range(model.chains if usable(model, need) else 0):
                if (model.id, model.version, sample) not in ready:
                    discount = need.discount
                    target = Target(model.id, model.version, discount, sample)
                    jobs[target] = Job(target, model)
    return list(jobs.values())


def _drop(store: Store, old: Iterable[TableKey]) -> None:
    """Drop tables of earlier versions of models, where no decision can have used them.

    Those at a discount of a policy that was ever in force are kept, for replays.
    """
    unused = list(old)
    if not unused:
        return
    try:
        used = {made(version).table_discount for version in policies.every(store)}
    except NotReady:
        return  # of a policy of another release, nobody knows the discount here
    for key in unused:
        if key.discount not in used:
            stored.delete(store, key)
