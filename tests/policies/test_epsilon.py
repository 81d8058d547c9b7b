"""Another policy followed, but for a share of plays."""

import dataclasses
from collections import Counter
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from policies import (
    NO_TABLES,
    Mixture,
    ModelSet,
    Policy,
    Scorer,
    Situation,
    Tables,
    choose,
    create,
    ready,
)
from policies.epsilon import Epsilon
from policies.myopic import Myopic
from policies.round_robin import RoundRobin
from policies.thompson import Thompson
from policies.uniform import Uniform
from tests.policies.instances import Instance, instances, paper_situation

SEEDS = st.integers(0, 2**63 - 1)


@dataclass(frozen=True, slots=True)
class Wavering:
    """Plays the first group, or else the last; needs tables and heeds rest."""

    rest_matters: ClassVar[bool] = True
    is_index: ClassVar[bool] = False
    table_discount: ClassVar[float] = 0.5

    def prepare(self, _models: ModelSet, tables: Tables) -> Scorer:
        assert tables.discount == 0.5

        def scores(situation: Situation, _seed: int) -> Mixture:
            rows = np.eye(len(situation.model))[[0, -1]]
            return Mixture(np.array([0.25, 0.75]), rows)

        return scores

    def cost(self, _situation: Situation) -> float:
        return 7.0


def test_propensities_are_what_counting_finds() -> None:
    case = dataclasses.replace(paper_situation(1), count=np.array([3, 1, 2, 1, 1]))
    scorer = ready(Epsilon(0.3), case.models)
    draws = 20_000

    choices = [choose(scorer(case, seed), case.count, seed) for seed in range(draws)]

    assert {(c.group == 0, round(c.propensity, 12)) for c in choices} == {
        (True, round(0.7 / 3 + 0.3 / 8, 12)),
        (False, round(0.3 / 8, 12)),
    }
    chance = {(c.group, c.member): c.propensity for c in choices}
    assert sum(chance.values()) == pytest.approx(1)
    for item, times in Counter((c.group, c.member) for c in choices).items():
        spread = np.sqrt(draws * chance[item] * (1 - chance[item]))
        assert abs(times - draws * chance[item]) < 4.5 * spread


@settings(deadline=None, max_examples=30)
@given(instances(), SEEDS)
def test_without_exploring_it_is_the_policy_followed(
    instance: Instance, seed: int
) -> None:
    case = instance.situation
    for epsilon, like in ((0, Myopic()), (1, Uniform())):
        scored = ready(Epsilon(epsilon), case.models)(case, seed)
        expected = choose(ready(like, case.models)(case, seed), case.count, seed)

        assert choose(scored, case.count, seed)[:3] == expected[:3]


def test_a_policy_that_chooses_at_random_is_followed_row_by_row() -> None:
    case = paper_situation(1)
    policy = Epsilon(0.2, Wavering())

    mixture = policy.prepare(case.models, NO_TABLES._replace(discount=0.5))(case, 0)

    assert isinstance(mixture, Mixture)
    assert mixture.weight.tolist() == pytest.approx([0.2, 0.6, 0.2])
    assert_array_equal(mixture.scores, [*np.eye(5)[[0, 4]], np.zeros(5)])


def test_it_is_what_the_policy_followed_is() -> None:
    case = paper_situation(1)
    wavering = Epsilon(policy=Wavering())

    assert (wavering.rest_matters, wavering.is_index) == (True, False)
    assert wavering.table_discount == 0.5
    assert wavering.cost(case) > 7
    assert (Epsilon().rest_matters, Epsilon().is_index) == (False, True)
    assert Epsilon(policy=RoundRobin()).rest_matters
    assert Epsilon().table_discount is None


def test_the_policy_followed_is_made_from_its_description() -> None:
    made = create("epsilon", {"policy": {"name": "rollout", "params": {"horizon": 3}}})

    assert made == Epsilon(0.1, create("rollout", {"horizon": 3}))
    assert create("epsilon", {"policy": {"name": "random"}}) == Epsilon(
        policy=Uniform()
    )
    assert create("epsilon", {}) == Epsilon(0.1, Myopic())


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (3, "policy: must be a policy that follows no other, not 3"),
        (None, "policy: must be a policy"),
        (Epsilon(), "policy: must be a policy that follows no other"),
        ({}, "policy.name: must be one of random, round_robin, .*, not None"),
        ({"name": "epsilon"}, "policy.name: must be one of .*, not 'epsilon'"),
        ({"name": ["myopic"]}, "policy.name: must be one of "),
        ({"name": "myopic", "params": 1}, "policy: must be a name and params"),
        ({"name": "myopic", "why": "x"}, "policy: must be a name and params"),
        ({"name": "myopic", "params": {"x": 1}}, "policy.params.x: myopic has no"),
        (
            {"name": "rollout", "params": {"horizon": 0}},
            "policy.params.horizon: must be a whole number from 1 to 50, not 0",
        ),
    ],
)
def test_what_is_wrong_with_the_policy_followed_is_named(
    value: object, message: str
) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        create("epsilon", {"policy": value})


def test_a_policy_followed_is_no_class() -> None:
    with pytest.raises(ValueError, match=r"^policy: "):
        Epsilon(policy=Myopic)  # type: ignore[arg-type]


def test_any_policy_may_be_followed(policy: type[Policy]) -> None:
    case = paper_situation(1)
    if policy in {Epsilon, Thompson}:
        return

    scorer = ready(Epsilon(0.5, policy()), case.models)

    assert choose(scorer(case, 1), case.count, 1).propensity >= 0.1
