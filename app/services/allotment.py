"""Which policy decides for a user: the one in force, or that of an experiment's arm."""

from dataclasses import dataclass

from app.domain import Experiment, Revision
from app.services import split
from app.services.catalogue import Catalogue
from app.services.in_force import InForce
from app.services.live import Live
from app.storage.store import Store


@dataclass(frozen=True, slots=True, eq=False)
class Allotted:
    """A policy for a user.

    experiment: that has a say in it, None: there is none
    arm:        of the experiment
    """

    policy: InForce
    experiment: Experiment | None = None
    arm: str | None = None


def allotted(
    store: Store, live: Live, known: Revision, catalogue: Catalogue, user: str
) -> Allotted:
    """The policy for a user; where the guard has fallen back, it is its for all."""
    experiment = live.experiment(store, known)
    if experiment is None or live.version(store, known.policy).is_fallback:
        return Allotted(live.policy(store, known, catalogue))
    arm = split.arm_of(experiment, user)
    own = {each.name: each.policy for each in experiment.arms}
    version = own.get(arm)  # the holdout is served by the one in force
    return Allotted(live.policy(store, known, catalogue, version), experiment, arm)
