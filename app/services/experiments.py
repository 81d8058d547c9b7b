"""Experiments: begun, changed while they run, and ended.

Each change is a version of its own, obeyed by every worker at its next request, as a
swap of the policy is.
"""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from app.domain import HOLDOUT, Arm, Experiment, Shadow
from app.errors import ExperimentFixed, ExperimentNotFound, ExperimentRuns, Fault
from app.services import arm_policies, new_experiments, split
from app.services.arm_policies import Act, Versions
from app.services.new_experiments import NewExperiment
from app.storage import audit, experiments, revision
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class History:
    """Versions of experiments, the latest first; and where the rest begins."""

    versions: Sequence[Experiment]
    next: int | None


def put(store: Store, new: NewExperiment, least: float, by: str) -> int:
    """Begin an experiment, or change the one that runs; tell its version.

    least: share that an arm must have
    """
    new_experiments.check(new, least)
    known = revision.current(store)
    present = experiments.by_version(store, known.experiment)
    before: Versions = {}
    if present is not None:
        before = arm_policies.kept(store, present.origin)
        _refuse_another(store, present, new, before)
    version = revision.advance_experiment(store, known)
    act = Act(version, known.policy, datetime.now(UTC), by)
    versions = arm_policies.put(store, new, before, act)
    arm_policies.see_to_tables(store, known, new)
    experiments.insert(store, _made(new, present, versions, act))
    if present is not None:
        experiments.end(store, present.version, act.at, by, new.note)
    detail = {"version": act.version, "note": new.note}
    audit.note(store, act.at, by, "experiment", new.name, detail)
    return act.version


def end(store: Store, note: str, by: str) -> int:
    """End the experiment that runs; tell its version."""
    known = revision.current(store)
    present = experiments.by_version(store, known.experiment)
    if present is None:
        raise ExperimentNotFound("No experiment runs.")
    now = datetime.now(UTC)
    revision.advance_experiment(store, known)
    experiments.end(store, present.version, now, by, note)
    detail = {"version": present.version, "note": note}
    audit.note(store, now, by, "end_experiment", present.name, detail)
    return present.version


def find(store: Store, version: int | None) -> Experiment:
    """A version; None: of the experiment that runs, else of the last one that did."""
    if version is None:
        last = experiments.page(store, experiments.LATEST, 1)
        if not last:
            raise ExperimentNotFound("There was no experiment yet.")
        return last[0]
    found = experiments.by_version(store, version)
    if found is None:
        fault = Fault("version", "unknown", version)
        raise ExperimentNotFound(f"There is no version {version}.", fault)
    return found


def history(store: Store, before: int, limit: int) -> History:
    found = experiments.page(store, before, limit + 1)
    shown = found[:limit]
    return History(shown, shown[-1].version if len(found) > limit else None)


def _refuse_another(
    store: Store, present: Experiment, new: NewExperiment, before: Versions
) -> None:
    """Refuse to make an experiment that runs another one."""
    if new.name != present.name:
        raise ExperimentRuns(present.name)
    faults = [*arm_policies.others(store, new, before)]
    if new.compared_with != present.control:
        message = f"is {present.control!r} for as long as it runs"
        faults.append(Fault("control", message, new.compared_with))
    if faults:
        raise ExperimentFixed(present.name, *faults)


def _made(
    new: NewExperiment, present: Experiment | None, versions: Versions, act: Act
) -> Experiment:
    return Experiment(
        version=act.version,
        name=new.name,
        origin=act.version if present is None else present.origin,
        salt=secrets.token_hex(16) if present is None else present.salt,
        arms=[Arm(arm.name, versions["arms", arm.name], arm.share) for arm in new.arms],
        holdout=new.shares[HOLDOUT],
        control=new.compared_with,
        split=split.divided(new.shares, () if present is None else present.split),
        shadows=[
            Shadow(one.name, policy, one.sample)
            for one in new.shadows
            if (policy := versions["shadows", one.name]) is not None
        ],
        policy=act.policy,
        note=new.note,
        at=act.at,
        by=act.by,
    )
