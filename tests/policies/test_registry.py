from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import pytest

from policies import (
    POLICIES,
    Bounds,
    Floats,
    ModelSet,
    Policy,
    Scorer,
    Situation,
    Tables,
    choose,
    create,
    params_of,
    ready,
)
from policies.epsilon import Epsilon
from policies.parameters import check
from tests.policies.instances import paper_situation


@dataclass(frozen=True, slots=True)
class Favourite:
    """Plays one group; stands for a policy that somebody adds."""

    rest_matters: ClassVar[bool] = False
    is_index: ClassVar[bool] = False
    table_discount: ClassVar[None] = None

    row: Annotated[int, Bounds(0, 9), "the group"] = 0

    def __post_init__(self) -> None:
        check(self)

    def prepare(self, _models: ModelSet, _tables: Tables) -> Scorer:
        return self._scores

    def cost(self, _situation: Situation) -> float:
        return 1.0

    def _scores(self, situation: Situation, _seed: int) -> Floats:
        return np.asarray(np.arange(len(situation.model)) == self.row, dtype=np.float64)


def test_a_new_policy_is_one_file_and_one_line() -> None:
    policies: dict[str, type[Policy]] = {**POLICIES, "favourite": Favourite}
    case = paper_situation(1)

    policy = create("favourite", {"row": 3}, policies)

    assert choose(ready(policy, case.models)(case, 0), case.count, 0).group == 3
    with pytest.raises(ValueError, match=r"^row: must be a whole number from 0 to 9"):
        create("favourite", {"row": 10}, policies)


def test_the_names_are_those_of_the_paper_and_baselines() -> None:
    assert list(POLICIES) == [
        "random",
        "round_robin",
        "myopic",
        "best_fixed",
        "rollout",
        "exact_rollout",
        "whittle",
        "lagrangian",
        "whittle_mc",
        "epsilon",
        "thompson",
    ]


def test_an_unknown_policy_is_named() -> None:
    with pytest.raises(ValueError, match=r"^name: must be one of random, .*'gittins'"):
        create("gittins", {})


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_is_made_again_from_its_parameters(name: str) -> None:
    made = create(name, {})

    assert create(name, params_of(made)) == made


def test_parameters_are_plain_and_complete() -> None:
    policies: dict[str, type[Policy]] = {**POLICIES, "favourite": Favourite}
    made = Epsilon(0.2, Favourite(3))

    params = params_of(made, policies)

    followed = {"name": "favourite", "params": {"row": 3}}
    assert params == {"epsilon": 0.2, "policy": followed}
    assert create("epsilon", params, policies) == made


@pytest.mark.parametrize("name", POLICIES)
def test_an_unknown_parameter_is_named(name: str) -> None:
    with pytest.raises(ValueError, match=rf"^speed: {name} has no such parameter"):
        create(name, {"speed": 1})


def test_no_class_attribute_passes_for_a_parameter() -> None:
    with pytest.raises(ValueError, match=r"^rest_matters: "):
        create("rollout", {"rest_matters": True})
