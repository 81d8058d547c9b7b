"""What every registered policy must do."""

import dataclasses
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    NEVER,
    NO_TABLES,
    POLICIES,
    Floats,
    Mixture,
    Model,
    ModelSet,
    Policy,
    Situation,
    choose,
    create,
    ready,
)
from tests.policies.instances import (
    Instance,
    instances,
    paper_situation,
    random_models,
    situation,
)

NAMES = st.sampled_from(sorted(POLICIES))
SEEDS = st.integers(0, 2**63 - 1)
ROUGH = 60  # points of a grid of beliefs
FAST: Mapping[str, Mapping[str, object]] = {
    "rollout": {"horizon": 3, "trajectories": 20},
    "whittle_mc": {"horizon": 3, "trajectories": 20, "iterations": 10},
    "thompson": {"policy": {"name": "exact_rollout", "params": {"horizon": 3}}},
}


def score(name: str, case: Situation, seed: int = 0) -> Floats:
    policy = create(name, FAST.get(name, {}))
    return flat(ready(policy, case.models, ROUGH)(case, seed))


def flat(scored: Floats | Mixture) -> Floats:
    """The scores; of a mixture, their mean over its rows."""
    if isinstance(scored, Mixture):
        return scored.weight @ scored.scores
    return scored


@settings(deadline=None, max_examples=60)
@given(NAMES, instances(), SEEDS)
def test_scores_are_finite_one_a_group_and_repeatable(
    name: str, instance: Instance, seed: int
) -> None:
    case = instance.situation
    before = [case.belief.copy(), case.model.copy(), case.count.copy()]

    scores = score(name, case, seed)

    assert scores.shape == case.model.shape
    assert scores.dtype == np.float64
    assert np.isfinite(scores).all()
    assert_array_equal(scores, score(name, case, seed))
    for array, kept in zip([case.belief, case.model, case.count], before, strict=True):
        assert_array_equal(array, kept)


@settings(deadline=None, max_examples=60)
@given(
    st.sampled_from(sorted(set(POLICIES) - {"round_robin"})),
    instances(),
    st.integers(0, 2**32),
)
def test_permuting_groups_permutes_scores(
    name: str, instance: Instance, seed: int
) -> None:
    case = instance.situation
    if len(np.unique(case.belief, axis=0)) < len(case.belief):
        return  # a base's ties are broken by row
    order = np.random.default_rng(seed).permutation(len(case.model))
    turned = Situation(
        case.models,
        case.model[order],
        case.belief[order],
        case.count[order],
        case.rested[order],
    )

    # a leaf adds up the worths of all groups, in their order
    assert_allclose(score(name, turned), score(name, case)[order], rtol=1e-12)


@settings(deadline=None, max_examples=60)
@given(NAMES, instances())
def test_splitting_a_group_into_items_changes_no_score(
    name: str, instance: Instance
) -> None:
    case = instance.situation
    rows = np.repeat(np.arange(len(case.count)), case.count)
    split = situation(
        case.models, case.model[rows].tolist(), case.belief[rows], [1] * len(rows)
    )

    assert_array_equal(score(name, split), score(name, case)[rows])


@settings(deadline=None, max_examples=60)
@given(NAMES, st.integers(0, 2**32), SEEDS)
def test_padding_changes_no_score(name: str, seed: int, draw: int) -> None:
    *small, large = random_models(seed, [3, 3, 3, 6])
    alone, padded = ModelSet.of(small), ModelSet.of([*small, large])
    beliefs = np.random.default_rng(seed).dirichlet(np.ones(3), 3)
    wide = np.pad(beliefs, ((0, 0), (0, 3)))

    scores = score(name, situation(alone, [0, 1, 2], beliefs, [1, 2, 1]), draw)

    assert_allclose(
        score(name, situation(padded, [0, 1, 2], wide, [1, 2, 1]), draw),
        scores,
        atol=1e-13,
    )


@pytest.mark.parametrize(
    ("name", "params"),
    [
        ("whittle", {}),
        ("lagrangian", {}),
        ("exact_rollout", {"base": "whittle"}),
        ("exact_rollout", {"base": ["myopic", "lagrangian"]}),
        ("exact_rollout", {"leaf": "lagrangian"}),
        ("rollout", {"base": "whittle"}),
    ],
)
def test_tables_that_are_not_of_the_models_are_refused(
    name: str, params: Mapping[str, object]
) -> None:
    model = random_models(4, [2])[0]
    parts = model.states, model.play, model.rest, model.like, model.prior
    unsure = ModelSet.of([Model(*parts, samples=[model] * 3)])

    with pytest.raises(ValueError, match=r"^tables: "):
        ready(create(name, params), unsure, ROUGH)  # has tables of single samples
    with pytest.raises(ValueError, match=r"^tables: "):
        create(name, params).prepare(unsure, NO_TABLES)


def test_samples_that_agree_are_the_model(policy: type[Policy]) -> None:
    made = policy()
    if made.table_discount is not None:
        return  # tables are of single samples: such a policy is followed by `thompson`
    model = random_models(4, [3])[0]
    parts = model.states, model.play, model.rest, model.like, model.prior
    rng = np.random.default_rng(4)
    belief, weight = rng.dirichlet(np.ones(3), 4), rng.dirichlet(np.ones(3), 4)
    pairs = (weight[:, :, None] * belief[:, None]).reshape(4, 9)

    scores = [
        flat(
            ready(made, models, ROUGH)(
                situation(models, [0] * 4, rows, [1, 2, 1, 1]), 3
            )
        )
        for models, rows in (
            (ModelSet.of([model]), belief),
            (ModelSet.of([Model(*parts, samples=[model] * 3)]), pairs),
        )
    ]

    assert_allclose(scores[1], scores[0], atol=1e-9)


def test_one_group_is_enough(policy: type[Policy]) -> None:
    models = ModelSet.of(random_models(1, [3]))
    case = situation(models, [0], models.prior, [1])

    scores = ready(policy(), models, ROUGH)(case, 0)

    assert choose(scores, case.count, 0).group == 0


def test_equal_items_tie_exactly(policy: type[Policy]) -> None:
    models = ModelSet.of(random_models(2, [3]))
    case = situation(models, [0] * 4, np.tile(models.prior, (4, 1)), [1] * 4)

    scores = flat(ready(policy(), models, ROUGH)(case, 7))

    assert len(set(scores.tolist())) == 1
    assert {choose(scores, case.count, seed).group for seed in range(100)} == {
        0,
        1,
        2,
        3,
    }


def test_no_candidates_raise(policy: type[Policy]) -> None:
    models = ModelSet.of(random_models(3, [3]))
    none = situation(models, [], np.empty((0, 3)), [])

    scores = flat(ready(policy(), models, ROUGH)(none, 0))

    assert scores.shape == (0,)
    with pytest.raises(ValueError, match="nothing to choose"):
        choose(scores, none.count, 0)


def test_a_policy_is_a_frozen_dataclass_that_estimates_its_cost(
    policy: type[Policy],
) -> None:
    made = policy()

    assert dataclasses.is_dataclass(policy)
    assert made == policy()
    assert hash(made) == hash(policy())
    assert 0 < made.cost(paper_situation(1)) < 1000


def test_only_round_robin_heeds_rest(policy: type[Policy]) -> None:
    case = paper_situation(1)
    recent = dataclasses.replace(case, rested=np.array([0, 4, 2, 9, 1]))
    scorer = ready(policy(), case.models, ROUGH)

    same = np.array_equal(flat(scorer(case, 0)), flat(scorer(recent, 0)))

    assert same is not policy().rest_matters


def test_round_robin_plays_what_was_never_played_then_the_least_recent() -> None:
    case = dataclasses.replace(paper_situation(1), rested=np.array([0, 4, NEVER, 9, 1]))

    assert np.argsort(-score("round_robin", case)).tolist() == [2, 3, 1, 4, 0]


def test_myopic_scores_are_expected_likes() -> None:
    assert_allclose(
        score("myopic", paper_situation(3)),
        [0.55, 0.445, 0.585, 0.435, 0.5875],
        atol=1e-15,
    )


@pytest.mark.parametrize(
    ("example", "worth", "item"),
    [(1, 14.1238, 0), (2, 8.9508, 3), (3, 12.963117368826, 0)],
)
def test_best_fixed_items_of_the_paper(example: int, worth: float, item: int) -> None:
    scores = score("best_fixed", paper_situation(example))

    assert scores.argmax() == item
    assert scores.max() == pytest.approx(worth, abs=5e-5 if example < 3 else 1e-11)


def test_without_a_future_best_fixed_is_myopic() -> None:
    case = paper_situation(1)
    scores = ready(create("best_fixed", {"discount": 0}), case.models)(case, 0)

    assert_allclose(scores, score("myopic", case), atol=1e-15)


def test_random_play_is_uniform_over_items() -> None:
    case = dataclasses.replace(paper_situation(1), count=np.array([1, 2, 3, 4, 90]))

    assert choose(score("random", case), case.count, 1).propensity == 0.01
