"""The policies of an experiment's arms and shadows, as versions among all others.

They are fixed for as long as it runs: what an arm has earned was earned by one policy.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import TypeAlias

from app.domain import Described, PolicyVersion, Revision
from app.errors import Fault
from app.services import index_coverage, rungs
from app.services.in_force import find_policy, needed
from app.services.new_experiments import NewExperiment
from app.services.policy_catalogue import plain
from app.storage import experiments, policies
from app.storage.store import Store
from policies import create

Place: TypeAlias = tuple[str, str]  # "arms" or "shadows", and a name among them
Versions: TypeAlias = Mapping[Place, int | None]


@dataclass(frozen=True, slots=True)
class Act:
    """Who makes which version of an experiment, under which policy in force, when."""

    version: int
    policy: int
    at: datetime
    by: str


def kept(store: Store, origin: int) -> Versions:
    """Versions of the policies that an experiment has, or has had; None: that in force.

    origin: the version with which it began
    """
    found: dict[Place, int | None] = {}
    for version in experiments.versions(store, origin):
        found |= {("arms", arm.name): arm.policy for arm in version.arms}
        found |= {("shadows", one.name): one.policy for one in version.shadows}
    return found


def others(store: Store, new: NewExperiment, before: Versions) -> Iterator[Fault]:
    """Arms and shadows that would have another policy than they had."""
    for field, number, one in new.each():
        if (field, one.name) in before:
            version = before[field, one.name]
            found = None if version is None else find_policy(store, version)
            had = None if found is None else Described(found.name, found.params)
            if had != (one.policy and plain(one.policy)):
                message = f"{one.name!r} has another; name this one otherwise"
                yield Fault(f"{field}.{number}.policy", message)


def put(store: Store, new: NewExperiment, before: Versions, act: Act) -> Versions:
    """Note the policies that are new; tell the versions of all."""
    latest = policies.latest(store)
    versions = dict(before)
    for field, _, one in new.each():
        if (field, one.name) not in before:
            versions[field, one.name] = None
            if one.policy is not None:
                latest += 1
                versions[field, one.name] = latest
                version = _version(latest, plain(one.policy), one.note, act)
                policies.insert(store, version)
    return versions


def see_to_tables(store: Store, known: Revision, new: NewExperiment) -> None:
    """Make rough index tables where policies need some; refuse what cannot have any."""
    found = (needed(one.policy) for _, _, one in new.each())
    wanted = dict.fromkeys(need for need in found if need is not None)
    for coverage in index_coverage.ensure(store, known, list(wanted)):
        index_coverage.refuse(coverage)


def _version(version: int, policy: Described, note: str, act: Act) -> PolicyVersion:
    return PolicyVersion(
        version,
        policy.name,
        policy.params,
        note,
        act.at,
        act.by,
        experiment=act.version,
        rungs=rungs.below(create(policy.name, policy.params)),
    )
