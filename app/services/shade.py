"""A decision taken once more, by a policy that is not served."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.domain import Experiment
from app.services import slates, split
from app.services.catalogue import Catalogue
from app.services.decisions import Candidates, Decision
from app.services.rungs import Rung
from app.storage.shadows import ShadowTotal
from policies import Policy

PARTS = 100  # of users, by whose differences it is known how sure a mean is


@dataclass(frozen=True, slots=True, eq=False)
class Considered:
    """What a decision was taken from, and what it came to.

    build:  the candidates, as a policy looks at them
    count:  places of the slot
    served: the decision for the first of them
    """

    experiment: Experiment
    catalogue: Catalogue
    user: str
    build: Callable[[Policy], Candidates]
    count: int
    served: Decision


def compared(considered: Considered, shadow: str, rung: Rung) -> ShadowTotal:
    """Decide again, and compare.

    It agrees where it chooses the item that was served, or one of which the same is
    believed. It gains what its choice is expected to earn more, now, by the models.
    """
    served = considered.served
    candidates = considered.build(rung.policy)
    chosen = slates.decide_next(candidates, rung, served.seed, (), considered.count)
    its = candidates.groups(np.array([chosen.serial, served.serial]))
    return ShadowTotal(
        considered.experiment.origin,
        shadow,
        split.slice_of("parts", considered.user) % PARTS,
        decisions=1,
        agreed=int(its[0] == its[1]),
        gained=chosen.predicted - served.predicted,
    )
