"""Which catalogue, policy, experiment and clock are in force: one row, kept in step.

Each part is a number that only grows; a unit of work is written if the parts on which
it relied still stand.
"""

import sqlalchemy as sa

from app.domain import Clock, Revision
from app.storage import tables
from app.storage.store import Store

CURRENT = sa.select(tables.revision)
SET_CATALOGUE = tables.revision.update().values(
    catalogue=sa.bindparam("to_catalogue"), epoch=sa.bindparam("to_epoch")
)
SET_POLICY = tables.revision.update().values(policy=sa.bindparam("to_policy"))
SET_CLOCK = tables.revision.update().values(
    clock=sa.bindparam("to_clock"), slot_s=sa.bindparam("to_slot_s")
)
SET_EXPERIMENT = tables.revision.update().values(
    experiment=sa.bindparam("to_experiment")
)
TALLIES = sa.select(tables.revision.c.tally)
SET_TALLIES = tables.revision.update().values(tally=sa.bindparam("to_tally"))
CHECKS = sa.select(tables.revision.c.guard)
SET_CHECKS = tables.revision.update().values(guard=sa.bindparam("to_guard"))


def current(store: Store) -> Revision:
    row = store.row(CURRENT)
    if row is None:
        raise LookupError("the database has no revision row: it was not migrated")
    clock = Clock(row.clock, row.slot_s)
    return Revision(row.catalogue, row.epoch, row.policy, clock, row.experiment)


def rely_on_catalogue(store: Store, known: Revision) -> None:
    """Write only if the catalogue is still this one."""
    store.rely_on_revision("catalogue", known.catalogue)


def rely_on_policy(store: Store, known: Revision) -> None:
    """Write only if the policy in force is still this one."""
    store.rely_on_revision("policy", known.policy)


def advance_catalogue(store: Store, known: Revision, *, new_epoch: bool) -> int:
    """Note a change of the catalogue, written only if none came before it."""
    version = known.catalogue + 1
    store.rely_on_revision("catalogue", known.catalogue)
    epoch = version if new_epoch else known.epoch
    store.write(SET_CATALOGUE, {"to_catalogue": version, "to_epoch": epoch})
    return version


def rely_on_policies(store: Store, known: Revision) -> None:
    """Write only if nobody has put a policy in force, for all or in an experiment.

    Both take the next version of a policy: so they rely on one another.
    """
    store.rely_on_revision("policy", known.policy)
    store.rely_on_revision("experiment", known.experiment)


def advance_policy(store: Store, known: Revision, version: int) -> None:
    """Note a change of policy, written only if none came before it."""
    rely_on_policies(store, known)
    store.write(SET_POLICY, {"to_policy": version})


def advance_experiment(store: Store, known: Revision) -> int:
    """Note a change of the experiment, written only if none came before it."""
    version = known.experiment + 1
    rely_on_policies(store, known)
    store.write(SET_EXPERIMENT, {"to_experiment": version})
    return version


def advance_clock(store: Store, known: Clock, slot_s: float | None) -> Clock:
    """Note a change of the clock, written only if none came before it."""
    clock = Clock(known.version + 1, slot_s)
    store.rely_on_revision("clock", known.version)
    store.write(SET_CLOCK, {"to_clock": clock.version, "to_slot_s": slot_s})
    return clock


def tallies(store: Store) -> int:
    """How often the plays of experiments were counted."""
    row = store.row(TALLIES)
    return 0 if row is None else int(row.tally)


def advance_tallies(store: Store, known: int) -> None:
    """Note a count, written only if none came before it."""
    store.rely_on_revision("tally", known)
    store.write(SET_TALLIES, {"to_tally": known + 1})


def checks(store: Store) -> int:
    """How often the guard has checked."""
    row = store.row(CHECKS)
    return 0 if row is None else int(row.guard)


def advance_checks(store: Store, known: int) -> None:
    """Note a check by the guard, written only if none came before it."""
    store.rely_on_revision("guard", known)
    store.write(SET_CHECKS, {"to_guard": known + 1})
