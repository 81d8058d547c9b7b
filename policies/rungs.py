"""What to fall back to where a policy takes too long, or fails.

The same plan with less look-ahead, then the policy that it would follow anyway, then
the item most likely to be liked now; and any item at all, where even that fails.
"""

from collections.abc import Iterator
from dataclasses import replace

from policies.best_fixed import BestFixed
from policies.epsilon import Epsilon
from policies.exact_rollout import ExactRollout
from policies.index_table import MOST_DISCOUNT
from policies.lagrangian import Lagrangian
from policies.myopic import Myopic
from policies.policy import Policy
from policies.rollout import Rollout
from policies.round_robin import RoundRobin
from policies.thompson import Thompson
from policies.uniform import Uniform
from policies.whittle import Whittle
from policies.whittle_mc import WhittleMC

FEWER = 10  # of so many trajectories, one is left
LAST_RESORTS: tuple[Policy, ...] = (Myopic(), Uniform())


def rungs(policy: Policy) -> tuple[Policy, ...]:
    """Return a policy and those to fall back to, each cheaper than the one before.

    All can be prepared with the index tables of the first. The last two are
    `LAST_RESORTS`, which need none.
    """
    found = [policy, *_lighter(policy)]
    return *found, *(last for last in LAST_RESORTS if last not in found)


def _lighter(policy: Policy) -> Iterator[Policy]:
    """Yield what plans less far than a policy, the furthest first."""
    match policy:
        case Epsilon() | Thompson():
            followed = [*_lighter(policy.policy)]
            if Myopic() not in (policy.policy, *followed):
                followed.append(Myopic())
            yield from (replace(policy, policy=each) for each in followed)
        case ExactRollout():
            if policy.depth > 1:
                yield replace(policy, depth=1)
            if policy.horizon > 1:
                yield replace(policy, depth=1, horizon=1)
            yield from _base(policy.bases[0], policy.discount)
        case Rollout():
            yield from _fewer(policy)
            yield from _base(policy.base, policy.discount)
        case WhittleMC():
            yield from _fewer(policy)
        case _:
            return


def _fewer(policy: Rollout | WhittleMC) -> Iterator[Policy]:
    if policy.trajectories >= FEWER:
        yield replace(policy, trajectories=policy.trajectories // FEWER)


def _base(name: str, discount: float) -> Iterator[Policy]:
    """Yield a base as a policy of its own, if it is another than the last resorts."""
    match name:
        case "whittle" if discount <= MOST_DISCOUNT:
            yield Whittle(discount=discount)
        case "lagrangian" if discount <= MOST_DISCOUNT:
            yield Lagrangian(discount=discount)
        case "best_fixed":
            yield BestFixed(discount=discount)
        case "round_robin":
            yield RoundRobin()
        case _:
            return
