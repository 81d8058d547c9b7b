"""What a policy falls to where it takes too long, or fails."""

import pytest
from hypothesis import given, settings

from policies import LAST_RESORTS, POLICIES, Policy, create, description, rungs
from tests.policies.instances import Instance, instances


def names(policy: Policy) -> list[str]:
    return [description(rung)[0] for rung in rungs(policy)]


@pytest.mark.parametrize("name", sorted(POLICIES))
def test_every_policy_ends_in_the_last_resorts_and_needs_no_further_tables(
    name: str,
) -> None:
    policy = create(name, {})

    stand = rungs(policy)

    assert stand[0] == policy
    assert set(stand[-2:]) == set(LAST_RESORTS)
    assert len(set(stand)) == len(stand)
    assert {rung.table_discount for rung in stand} <= {None, policy.table_discount}
    for rung in stand:
        assert create(*description(rung)) == rung


def test_a_plan_looks_less_far_then_follows_its_base_then_looks_at_now() -> None:
    deep = create("exact_rollout", {"depth": 2, "discount": 0.9})

    stand = rungs(deep)

    assert [getattr(rung, "depth", None) for rung in stand[:3]] == [2, 1, 1]
    assert [getattr(rung, "horizon", None) for rung in stand[:3]] == [3, 3, 1]
    assert stand[3] == create("whittle", {"discount": 0.9})
    assert names(deep)[3:] == ["whittle", "myopic", "random"]


def test_what_explores_goes_on_exploring() -> None:
    followed = {"name": "exact_rollout", "params": {"base": "myopic"}}
    stand = rungs(create("epsilon", {"epsilon": 0.2, "policy": followed}))

    assert [description(rung)[0] for rung in stand] == [
        *["epsilon"] * 3,
        "myopic",
        "random",
    ]
    assert {getattr(rung, "epsilon", 0.2) for rung in stand} == {0.2}


def test_a_base_without_tables_at_its_discount_is_left_out() -> None:
    assert "whittle" not in names(
        create("rollout", {"base": "whittle", "discount": 0.9999})
    )


@settings(deadline=None, max_examples=30)
@given(instances())
def test_each_rung_is_cheaper_than_the_one_above(instance: Instance) -> None:
    for name, params in (
        ("exact_rollout", {"depth": 3}),
        ("rollout", {}),
        ("whittle_mc", {}),
        ("epsilon", {"policy": {"name": "exact_rollout"}}),
    ):
        costs = [rung.cost(instance.situation) for rung in rungs(create(name, params))]
        assert costs == sorted(costs, reverse=True)
