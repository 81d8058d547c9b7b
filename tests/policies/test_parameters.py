import math

import pytest

from policies import Bounds, Parameter, Policy, create, parameters
from policies.best_fixed import BestFixed
from policies.epsilon import Epsilon
from policies.exact_rollout import ExactRollout
from policies.rollout import Rollout


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("base", "gittins"),
        ("base", 1),
        ("horizon", 0),
        ("horizon", 51),
        ("horizon", 5.0),
        ("horizon", True),
        ("horizon", "5"),
        ("horizon", None),
        ("trajectories", 10_001),
        ("trajectories", 0),
        ("discount", 1),
        ("discount", 1.0),
        ("discount", -0.01),
        ("discount", math.nan),
        ("discount", math.inf),
        ("discount", False),
        ("discount", "0.9"),
        ("reward", "likes"),
        ("reward", ["click"]),
        ("common_random_numbers", 1),
        ("common_random_numbers", "true"),
        ("reading", ""),
    ],
)
def test_a_wrong_value_is_named(field: str, value: object) -> None:
    with pytest.raises(
        ValueError, match=rf"^{field}: must be .*, not {value!r}".replace("[", r"\[")
    ):
        create("rollout", {field: value})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("horizon", 1),
        ("horizon", 50),
        ("trajectories", 10_000),
        ("discount", 0),
        ("discount", 0.999),
    ],
)
def test_bounds_are_included(field: str, value: object) -> None:
    assert getattr(create("rollout", {field: value}), field) == value


def test_a_whole_number_is_kept_as_a_fraction(policy: type[Policy]) -> None:
    """Else code would be compiled for it, in the middle of a request."""
    fractions = [p for p in parameters(policy) if p.kind is float]

    made = policy(**{parameter.name: 0 for parameter in fractions})

    kept = [getattr(made, parameter.name) for parameter in fractions]
    assert [(value, type(value)) for value in kept] == [(0.0, float)] * len(kept)


def test_policies_declare_their_parameters() -> None:
    (discount,) = parameters(BestFixed)
    assert discount == Parameter(
        "discount",
        float,
        Bounds(0, 1, below=True),
        (),
        "worth of a like in the next slot against one now",
    )
    assert [(p.name, p.kind) for p in parameters(Rollout)] == [
        ("base", str),
        ("horizon", int),
        ("trajectories", int),
        ("discount", float),
        ("reward", str),
        ("common_random_numbers", bool),
        ("reading", str),
        ("allocation", str),
    ]
    base = next(parameters(ExactRollout))
    names = ("myopic", "whittle", "lagrangian", "best_fixed", "round_robin")
    assert (base.choices, base.several) == (names, True)
    assert next(parameters(Rollout)).choices == (*names, "random")


def test_a_parameter_may_be_a_policy() -> None:
    epsilon, policy = parameters(Epsilon)

    assert not epsilon.is_policy
    assert policy.is_policy
    assert policy == Parameter("policy", Policy, None, (), "policy followed otherwise")


def test_parameters_have_descriptions(policy: type[Policy]) -> None:
    assert all(parameter.description for parameter in parameters(policy))


def test_defaults_are_the_papers() -> None:
    policy = Rollout()

    assert (policy.horizon, policy.trajectories, policy.discount) == (5, 100, 0.95)
