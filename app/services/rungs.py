"""The rungs of a policy: itself, and what decides where it takes too long or fails."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.domain import Described, PolicyVersion
from app.services.pace import Pace
from app.services.policy_catalogue import made
from policies import (
    LAST_RESORTS,
    Floats,
    Mixture,
    ModelSet,
    Policy,
    Scorer,
    Situation,
    Tables,
    description,
    rungs,
)


@dataclass(frozen=True, slots=True, eq=False)
class Rung:
    """A policy that is ready to decide for one set of models, and its pace here."""

    policy: Policy
    scorer: Scorer
    pace: Pace


def below(policy: Policy) -> Sequence[Described]:
    """What a policy falls to, in the form in which that is kept with its version."""
    _, *lower = rungs(policy)
    return [Described(*description(one)) for one in lower]


def policies_of(version: PolicyVersion) -> Sequence[Policy]:
    """The policies of a version by rung: its own comes first.

    An earlier release kept none that it falls to: then there are the last resorts.
    """
    own = made(version)
    if version.rungs is None:
        return own, *(last for last in LAST_RESORTS if last != own)
    return own, *map(made, version.rungs)


def prepared(policy: Policy, models: ModelSet, tables: Tables, pace: Pace) -> Rung:
    """Make a policy ready; one that cannot be made so fails when it is to decide."""
    try:
        return Rung(policy, policy.prepare(models, tables), pace)
    except Exception as error:  # noqa: BLE001 - told when the rung is missed
        return failing(policy, error, pace)


def failing(policy: Policy, error: Exception, pace: Pace) -> Rung:
    """A policy that can decide nothing, and says why."""

    def scores(_situation: Situation, _seed: int) -> Floats | Mixture:
        raise error

    return Rung(policy, scores, pace)
