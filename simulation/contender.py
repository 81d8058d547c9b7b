"""Policies that are ready to be tried against each other."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

from policies import (
    MOST_POINTS,
    NO_TABLES,
    POLICIES,
    ModelSet,
    Policy,
    Scorer,
    Tables,
    build_all,
)

Progress = Callable[[float], object]
AT_ONCE = tuple(
    POLICIES[name]
    for name in ("random", "round_robin", "myopic", "best_fixed", "whittle")
)
NOTHING: Mapping[float, Tables] = MappingProxyType({})
MOODLESS = tuple(POLICIES[name] for name in ("random", "round_robin", "best_fixed"))


@dataclass(frozen=True, slots=True, eq=False)
class Contender:
    """A policy that is ready for its models.

    Attributes:
        scorer: of the policy.
        at_once: whether no score depends on another group, on the seed, or on a mood:
            then the groups of many runs can be scored in one call.
    """

    scorer: Scorer
    at_once: bool


def goes_at_once(policy: Policy, models: ModelSet) -> bool:
    """Say whether a policy scores groups of many runs in one call, if it is indexable.

    Runs have moods of their own.
    """
    return isinstance(policy, AT_ONCE if models.classes == 1 else MOODLESS)


def contenders(
    policies: Sequence[Policy],
    models: ModelSet,
    progress: Progress = lambda _share: None,
    at_hand: Mapping[float, Tables] = NOTHING,
    most_points: int = MOST_POINTS,
) -> Sequence[Contender]:
    """Make policies ready; index tables are built once for all that share a discount.

    Args:
        policies: with any parameters.
        models: M models.
        progress: told the share of the tables that is built, from 0 to 1.
        at_hand: tables that need not be built, by discount.
        most_points: of the grids of others; 300 give rough tables at once.
    """
    discounts = table_discounts(policies) - at_hand.keys()
    tables = dict(at_hand)
    for done, discount in enumerate(discounts):
        advance = partial(_advance, progress, done, len(discounts))
        tables[discount] = build_all(
            models.separated(), discount, most_points, progress=advance
        )
    return [_contender(policy, models, tables) for policy in policies]


def table_discounts(policies: Sequence[Policy]) -> set[float]:
    """Return the discounts at which policies look scores up in index tables."""
    needed = (policy.table_discount for policy in policies)
    return {discount for discount in needed if discount is not None}


def _advance(progress: Progress, done: int, total: int, share: float) -> None:
    progress((done + share) / total)


def _contender(
    policy: Policy, models: ModelSet, tables: Mapping[float, Tables]
) -> Contender:
    discount = policy.table_discount
    own = NO_TABLES if discount is None else tables[discount]
    # Without an index of each item for itself, Whittle's falls back on a common price.
    at_once = goes_at_once(policy, models) and own.indexable
    return Contender(policy.prepare(models, own), at_once)
