"""Which policies choose plays now: what the guard judges models by."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from app.domain import PolicyVersion, Revision
from app.services.guard_reading import Told
from app.services.guard_scores import Outcome
from app.services.in_force import find_policy
from app.storage import experiments
from app.storage.store import Store


@dataclass(frozen=True, slots=True)
class Regime:
    """The policy in force for all, and those of arms; under a fallback it alone.

    number: changes whenever one of them does
    """

    known: Revision
    present: PolicyVersion
    policies: Sequence[PolicyVersion]

    @property
    def number(self) -> int:
        return max(policy.version for policy in self.policies)

    def of(self, told: Iterable[Told]) -> Sequence[Outcome]:
        """Outcomes of plays that one of these policies has chosen."""
        versions = {policy.version for policy in self.policies}
        return [play.outcome for play in told if play.policy in versions]


def present(store: Store, known: Revision) -> Regime:
    """What chooses plays now."""
    for_all = find_policy(store, known.policy)
    experiment = experiments.by_version(store, known.experiment)
    if experiment is None or for_all.is_fallback:
        return Regime(known, for_all, [for_all])
    arms = [arm.policy for arm in experiment.arms if arm.policy is not None]
    return Regime(known, for_all, [for_all, *(find_policy(store, one) for one in arms)])
