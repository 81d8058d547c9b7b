from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    NO_TABLES,
    Floats,
    Mixture,
    Model,
    ModelSet,
    Situation,
    Tables,
    create,
    untouched,
)
from policies.rollout import Rollout
from tests.policies.instances import (
    Instance,
    moods,
    paper_instance,
    paper_situation,
    random_models,
    rough_tables,
    situation,
    slates,
)
from tests.policies.oracles import (
    Plan,
    Trials,
    exact_scores,
    naive_halving,
    naive_rollout,
)
from tests.policies.rules import Rules

SEEDS = st.integers(0, 2**63 - 1)
PLAIN = ("random", "myopic", "best_fixed", "round_robin")
EXACT = [3.53666157, 3.30837371, 3.41343076, 3.30837371, 3.40664325]


def rollouts(bases: Sequence[str]) -> SearchStrategy[Rollout]:
    return st.builds(
        Rollout,
        base=st.sampled_from(bases),
        horizon=st.integers(1, 5),
        trajectories=st.integers(1, 12),
        discount=st.sampled_from([0.0, 0.5, 0.95]),
        reward=st.sampled_from(["expected", "click"]),
        common_random_numbers=st.booleans(),
        reading=st.sampled_from(["tail", "literal"]),
    )


def score(
    policy: Rollout, case: Situation, seed: int, tables: Tables = NO_TABLES
) -> Floats:
    scores = policy.prepare(case.models, tables)(case, seed)
    assert not isinstance(scores, Mixture)
    return scores


def trials(
    policy: Rollout, instance: Instance, seed: int, tables: Tables = NO_TABLES
) -> Trials:
    rules = Rules(instance, tables, policy.discount)
    rule = None if policy.base == "random" else rules.rule(policy.base)
    return Trials(policy, instance, seed, rule)


def exact(
    instance: Instance, horizon: int, base: str = "myopic", discount: float = 0.95
) -> list[float]:
    """Return what the scores of a rollout estimate, in the reading "tail"."""
    rule = None
    if base != "random":
        rule = Rules(instance, NO_TABLES, discount).rule(base)
    by_rest = base == "round_robin"
    return exact_scores(Plan([rule], horizon, discount), instance, by_rest=by_rest)


@settings(deadline=None, max_examples=120)
@given(rollouts(PLAIN), slates(signals=(1, 2, 3)), SEEDS)
def test_scores_are_those_of_separate_trajectories_of_separate_items(
    policy: Rollout, instance: Instance, seed: int
) -> None:
    expected = naive_rollout(trials(policy, instance, seed))

    scores = score(policy, instance.situation, seed)

    assert_allclose(scores, expected, rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=60)
@given(rollouts(PLAIN), moods(slates(signals=(1, 2, 3))), SEEDS)
def test_trajectories_lead_through_moods(
    policy: Rollout, instance: Instance, seed: int
) -> None:
    expected = naive_rollout(trials(policy, instance, seed))

    scores = score(policy, instance.situation, seed)

    assert_allclose(scores, expected, rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=30)
@given(rollouts(("whittle", "lagrangian")), slates(most=3, signals=(2, 3)), SEEDS)
def test_scores_of_bases_by_tables_are_those_of_separate_trajectories(
    policy: Rollout, instance: Instance, seed: int
) -> None:
    case = instance.situation
    tables = rough_tables(case.models, policy.discount)
    expected = naive_rollout(trials(policy, instance, seed, tables))

    scores = score(policy, case, seed, tables)

    assert_allclose(scores, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("horizon", "trajectories"), [(50, 3), (12, 100)])
@pytest.mark.parametrize("base", ["random", "myopic"])
def test_long_trajectories_too(base: str, horizon: int, trajectories: int) -> None:
    policy = Rollout(base=base, horizon=horizon, trajectories=trajectories)  # type: ignore[arg-type]
    instance = paper_instance(1)

    expected = naive_rollout(trials(policy, instance, 1))

    assert_allclose(score(policy, instance.situation, 1), expected, rtol=0, atol=1e-11)


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
@given(st.sampled_from(PLAIN), slates(most=3, signals=(2, 3)), st.booleans())
def test_many_trajectories_approach_the_exact_value(
    base: str,
    instance: Instance,
    common: bool,  # noqa: FBT001 - drawn
) -> None:
    horizon = 2 if base == "random" else 3
    policy = Rollout(
        base=base,  # type: ignore[arg-type]
        horizon=horizon,
        trajectories=10_000,
        common_random_numbers=common,
    )

    scores = score(policy, instance.situation, 1)

    assert_allclose(scores, exact(instance, horizon, base), atol=0.03)


@settings(deadline=None, max_examples=60)
@given(
    rollouts(PLAIN).map(lambda policy: replace(policy, allocation="halving")),
    slates(most=6, signals=(2, 3)),
    SEEDS,
)
def test_halving_gives_the_better_half_the_trajectories_of_the_others(
    policy: Rollout, instance: Instance, seed: int
) -> None:
    expected, used = naive_halving(trials(policy, instance, seed))

    scores = score(policy, instance.situation, seed)

    assert_allclose(scores, expected, rtol=0, atol=1e-12)
    candidates = len(set(trials(policy, instance, seed).candidates))
    rounds = max(np.ceil(np.log2(candidates)), 1)
    budget = policy.trajectories * candidates
    assert abs(used - budget) <= 2 * candidates + rounds


def test_the_survivor_of_halving_scores_highest_by_all_its_trajectories() -> None:
    """Of five items, it has 15 / 5 / 3 + 15 / 3 / 3 + 15 / 2 / 3 of them."""
    case = paper_situation(1)
    policy = Rollout(trajectories=3, reward="click", allocation="halving")
    longer = Rollout(trajectories=1 + 1 + 2, reward="click")

    for seed in range(100):
        halved = score(policy, case, seed)
        survivor = halved.argmax()
        equal = score(longer, case, seed)[survivor]
        assert halved[survivor] == pytest.approx(equal, abs=1e-12)
        assert len(set(halved.tolist())) == 5


@pytest.mark.parametrize("example", [1, 2, 3])
def test_halving_finds_the_best_item_with_enough_trajectories(example: int) -> None:
    policy = Rollout(trajectories=5_000, allocation="halving")
    best = int(np.argmax(exact(paper_instance(example), 5)))

    for seed in range(5):
        assert score(policy, paper_situation(example), seed).argmax() == best


def test_halving_finds_the_best_item_more_often_than_as_many_for_all() -> None:
    rng = np.random.default_rng(10)
    models = ModelSet.of(random_models(10, [3] * 16))
    case = situation(models, range(16), rng.dirichlet(np.ones(3), 16), [1] * 16)
    best = score(Rollout(trajectories=10_000), case, 1).argmax()

    def found(allocation: str) -> int:
        policy = Rollout(
            trajectories=30,
            reward="click",
            common_random_numbers=False,
            allocation=allocation,  # type: ignore[arg-type]
        )
        return sum(score(policy, case, seed).argmax() == best for seed in range(300))

    assert found("halving") > found("equal") + 30


def test_the_preset_of_the_paper_is_what_it_describes() -> None:
    paper = create("rollout", {"preset": "paper"})

    assert paper == Rollout(
        base="myopic",
        horizon=5,
        trajectories=100,
        reward="click",
        common_random_numbers=False,
        reading="tail",
    )
    assert create("rollout", {"preset": "paper", "horizon": 3}) == replace(
        Rollout(reward="click", common_random_numbers=False), horizon=3
    )


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
