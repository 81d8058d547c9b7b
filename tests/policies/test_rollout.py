from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import Floats, Mixture, Model, ModelSet, Situation, ready, untouched
from policies.rollout import Rollout
from tests.policies.instances import (
    Instance,
    instances,
    paper_instance,
    paper_situation,
    random_models,
    situation,
)
from tests.policies.oracles import base_value, exact_rollout, items_of, naive_rollout

ROLLOUTS = st.builds(
    Rollout,
    base=st.sampled_from(["random", "myopic"]),
    horizon=st.integers(1, 5),
    trajectories=st.integers(1, 12),
    discount=st.sampled_from([0.0, 0.5, 0.95]),
    reward=st.sampled_from(["expected", "click"]),
    common_random_numbers=st.booleans(),
    reading=st.sampled_from(["tail", "literal"]),
)
EXACT = [3.53666157, 3.30837371, 3.41343076, 3.30837371, 3.40664325]


def score(policy: Rollout, case: Situation, seed: int) -> Floats:
    scores = ready(policy, case.models)(case, seed)
    assert not isinstance(scores, Mixture)
    return scores


@settings(deadline=None, max_examples=150)
@given(ROLLOUTS, instances(), st.integers(0, 2**63 - 1))
def test_scores_are_those_of_separate_trajectories_of_separate_items(
    policy: Rollout, instance: Instance, seed: int
) -> None:
    expected = naive_rollout(policy, instance, seed)

    assert_allclose(
        score(policy, instance.situation, seed), expected, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize(("horizon", "trajectories"), [(50, 3), (12, 100)])
@pytest.mark.parametrize("base", ["random", "myopic"])
def test_long_trajectories_too(base: str, horizon: int, trajectories: int) -> None:
    policy = Rollout(base=base, horizon=horizon, trajectories=trajectories)  # type: ignore[arg-type]
    instance = paper_instance(1)

    expected = naive_rollout(policy, instance, 1)

    assert_allclose(score(policy, instance.situation, 1), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("plays", "value"), [(2, 1.21720187), (5, 2.98905286), (10, 5.48314754)]
)
def test_the_oracle_has_the_myopic_values_of_example_one(
    plays: int, value: float
) -> None:
    assert base_value(items_of(paper_instance(1)), plays, 0.95) == pytest.approx(
        value, abs=1e-8
    )


def test_the_oracle_has_the_exact_scores_of_example_one() -> None:
    assert_allclose(exact_rollout(paper_instance(1), 5, 0.95), EXACT, atol=1e-8)


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"common_random_numbers": False},
        {"reward": "click"},
        {"reward": "click", "common_random_numbers": False},
    ],
)
def test_scores_are_unbiased(params: Mapping[str, object]) -> None:
    policy = Rollout(trajectories=1000, **params)  # type: ignore[arg-type]
    case = paper_situation(1)

    runs = np.array([score(policy, case, seed) for seed in range(40)])

    error = runs.std(axis=0, ddof=1) / np.sqrt(len(runs))
    assert (error < 0.012).all()
    assert (np.abs(runs.mean(axis=0) - EXACT) < 4 * error).all()


@settings(deadline=None, max_examples=15)
@given(instances(most=3))
def test_many_trajectories_approach_the_exact_value(instance: Instance) -> None:
    policy = Rollout(horizon=3, trajectories=10_000)

    scores = score(policy, instance.situation, 1)

    assert_allclose(scores, exact_rollout(instance, 3, 0.95), atol=0.03)


@settings(deadline=None, max_examples=15)
@given(instances(most=3), st.booleans())
def test_a_random_base_approaches_the_mean_over_all_its_choices(
    instance: Instance,
    common: bool,  # noqa: FBT001 - drawn
) -> None:
    policy = Rollout(
        base="random", horizon=2, trajectories=10_000, common_random_numbers=common
    )

    scores = score(policy, instance.situation, 1)

    exact = exact_rollout(instance, 2, 0.95, base="random")
    assert_allclose(scores, exact, atol=0.03)


def test_the_literal_reading_counts_the_first_reward_again_and_plays_once_less() -> (
    None
):
    case = paper_situation(1)
    own = np.array([0.59, 0.435, 0.54, 0.435, 0.55])
    tail = score(Rollout(horizon=4, reading="tail"), case, 3)

    literal = score(Rollout(horizon=5, reading="literal"), case, 3)

    assert_allclose(literal, own + 0.95 * tail, atol=1e-12)
    assert_allclose(
        score(Rollout(horizon=1, reading="literal"), case, 3), 1.95 * own, atol=1e-12
    )


def test_a_seed_decides() -> None:
    case = paper_situation(1)

    assert_array_equal(score(Rollout(), case, 1), score(Rollout(), case, 1))
    assert (score(Rollout(), case, 1) != score(Rollout(), case, 2)).all()


def test_without_a_future_rollout_is_myopic() -> None:
    own = [0.59, 0.435, 0.54, 0.435, 0.55]

    assert_allclose(score(Rollout(discount=0), paper_situation(1), 1), own, atol=1e-15)


def test_common_random_numbers_are_common() -> None:
    case = paper_situation(1)

    shared = score(Rollout(), case, 1)
    separate = score(Rollout(common_random_numbers=False), case, 1)

    assert shared[0] == separate[0]
    assert (shared[1:] != separate[1:]).all()


def test_equal_groups_tie_exactly_wherever_they_stand() -> None:
    models = ModelSet.of(random_models(5, [4] * 6))
    rows = [0, 1, 2, 3, 4, 5, 0, 3, 1]
    case = situation(models, rows, models.prior[rows], [1] * 9)

    for seed in range(20):
        scores = score(Rollout(horizon=8), case, seed)
        assert_array_equal(scores[[6, 8, 7]], scores[[0, 1, 3]])


def test_common_random_numbers_compare_better() -> None:
    case = paper_situation(1)

    def spread(*, common: bool) -> float:
        policy = Rollout(common_random_numbers=common, reward="click")
        runs = np.array([score(policy, case, seed) for seed in range(300)])
        return float((runs[:, 0] - runs[:, 2]).std())

    assert spread(common=True) < 0.9 * spread(common=False)


def test_expected_rewards_are_far_less_noisy_than_clicks() -> None:
    case = paper_situation(1)
    clicks = np.array([score(Rollout(reward="click"), case, s) for s in range(200)])
    expected = np.array([score(Rollout(), case, s) for s in range(200)])

    assert expected.var(axis=0).mean() < clicks.var(axis=0).mean() / 10


def test_a_group_of_one_item_is_used_up() -> None:
    """A good item that playing ruins: with more of its kind the future is brighter."""
    ruined = Model(("good", "bad"), [[0, 1], [0, 1]], np.eye(2), [1, 0], [1, 0])
    models = ModelSet.of([ruined])
    policy = Rollout(horizon=3, discount=0.5, trajectories=1)

    values = [
        score(policy, situation(models, [0], models.prior, [items]), 1)[0]
        for items in range(1, 6)
    ]

    assert values == [1.0, 1.5, 1.75, 1.875, 1.875]


def tied_scores(models: list[Model], counts: list[int]) -> list[float]:
    made = ModelSet.of(models)
    case = situation(made, range(len(models)), made.prior, counts)
    policy = Rollout(horizon=2, discount=0.5, trajectories=1)
    return [float(value) for value in score(policy, case, 1)]


STEADY = Model(("a", "b"), np.eye(2), np.eye(2), [0.5, 0.5], [1, 0])
RIPE = Model(("a", "b"), [[0, 1], [0, 1]], np.eye(2), [0.5, 1], [1, 0])


POOR = Model(("a", "b"), np.eye(2), np.eye(2), [0, 0], [1, 0])


def test_a_base_breaks_ties_by_the_lowest_row() -> None:
    """Both items have an even chance; once played, the ripe one is liked for sure."""
    assert tied_scores([RIPE, STEADY], [1, 1]) == [1.25, 1.0]
    assert tied_scores([STEADY, RIPE], [1, 1]) == [0.875, 1.25]
    assert tied_scores([RIPE, STEADY, POOR], [1, 1, 1])[2] == 0.5
    assert tied_scores([STEADY, RIPE, POOR], [1, 1, 1])[2] == 0.375


def test_a_base_breaks_ties_within_a_group_for_the_untouched() -> None:
    """An even chance at first and after one play; after two a like is sure."""
    late = Model(
        ("a", "b", "c"),
        [[0, 1, 0], [0, 0, 1], [0, 0, 1]],
        np.eye(3),
        [0.5, 0.5, 1],
        [1, 0, 0],
    )

    assert tied_scores([late], [1]) == [1.0]
    assert tied_scores([late], [2]) == [0.875]


def test_a_huge_catalogue_is_as_easy_as_a_small_one() -> None:
    models = ModelSet.of(random_models(4, [4] * 6))
    belief = untouched(models, 10)
    small = situation(models, range(6), belief, [10] * 6)
    large = situation(models, range(6), belief, [10**9] * 6)

    assert_array_equal(score(Rollout(), small, 1), score(Rollout(), large, 1))
