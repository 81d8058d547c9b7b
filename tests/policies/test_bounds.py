"""Bounds on what any policy earns, against optima that are known or tried out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from policies import Bound, ModelSet, bound, effort, subsidy, worth_for_ever
from policies.index_table import divisions_of
from tests.policies.instances import (
    Instance,
    instances,
    paper_situation,
    random_models,
    rough_tables,
    situation,
    slates,
)
from tests.policies.oracles import CALM, Plan, exact_scores
from tests.policies.rules import Rules

OPTIMUM = {2: 8.986321013638, 3: 12.963117368826}


def optimum(instance: Instance, discount: float, plays: int, after: float) -> float:
    """Return the most that so many plays earn, with what is earned after them."""
    plan = Plan([None], 0, discount, plays, lambda _world, _rule: after)
    return max(exact_scores(plan, instance))


@pytest.mark.parametrize(
    ("example", "published"), [(1, 14.4427), (2, 9.0955), (3, 13.0547)]
)
def test_lagrangian_bounds_of_the_paper(example: int, published: float) -> None:
    """On a grid of 20 divisions, as another implementation found them."""
    found = bound(paper_situation(example), 0.95, most_points=1_800)

    assert found.value == pytest.approx(published, abs=1e-4)


@pytest.mark.parametrize(("example", "depth"), [(2, 1), (2, 2), (3, 1), (3, 2), (3, 4)])
def test_looking_ahead_bounds_meet_the_optima_of_the_paper(
    example: int, depth: int
) -> None:
    """Which are what item 3 once and then 4, and item 1 for ever, earn."""
    found = bound(paper_situation(example), 0.95, depth, 1_800)

    assert -1e-9 <= found.value - OPTIMUM[example] <= 2e-6


def test_the_bound_of_example_one_is_near_what_whittle_earns() -> None:
    """Which is 14.234, give or take .005; six plays and a finer grid give 14.2943."""
    case = paper_situation(1)

    found = bound(case, 0.95, 4, 1_800)

    assert max(worth_for_ever(case, 0.95)) < 14.229 < found.value < 14.345


@pytest.mark.parametrize("example", [1, 2, 3])
def test_bounds_fall_with_depth_and_with_finer_grids(example: int) -> None:
    case = paper_situation(example)

    def bounds(points: int) -> list[float]:
        return [bound(case, 0.95, depth, points).value for depth in range(4)]

    coarse, fine = bounds(300), bounds(1_800)

    assert (np.diff(coarse) <= 2e-6).all()
    assert (np.diff(fine) <= 2e-6).all()
    assert (np.subtract(fine, coarse) <= 2e-6).all()


@settings(deadline=None, max_examples=30)
@given(
    slates(most=2, signals=(2, 3), most_plays=2),
    st.sampled_from([0.0, 0.3, 0.6]),
    st.integers(1, 2),
)
def test_no_plays_earn_more_than_a_bound_and_some_earn_nearly_as_much(
    drawn: Instance, discount: float, depth: int
) -> None:
    """What comes after the slots looked ahead is at most the best reward for ever."""
    plays = min(drawn.plays, sum(drawn.counts))
    instance = replace(drawn, plays=plays, chosen=())
    case = instance.situation
    most = max(float(model.like.max()) for model in instance.models)
    after = plays * most / (1 - discount)

    above, found = (bound(case, discount, d, 300).value for d in (0, depth))

    slots = depth if plays == 1 else 1
    assert optimum(instance, discount, slots * plays, 0.0) - 1e-9 <= found
    if slots == depth:
        assert found <= optimum(instance, discount, depth * plays, after) + 1e-3
    assert found <= above + 2e-6


def test_a_slot_that_has_begun_has_no_bound() -> None:
    case = Instance(
        tuple(random_models(1, [2])),
        (0,),
        (np.array([0.5, 0.5]),),
        (3,),
        plays=2,
        chosen=((0, np.array([0.5, 0.5])),),
    ).situation

    with pytest.raises(ValueError, match="slate: the slot has begun"):
        bound(case, 0.9)


@settings(deadline=None, max_examples=30)
@given(slates(signals=(2, 3)), st.sampled_from([0.5, 0.9]))
def test_playing_one_item_for_ever_earns_no_more_than_the_bound(
    instance: Instance, discount: float
) -> None:
    alone = replace(instance, plays=1, chosen=())
    rules = Rules(alone, rough_tables(alone.situation.models, discount), discount)

    worth = worth_for_ever(alone.situation, discount)

    ever = rules.rule("best_fixed")
    assert_allclose(worth, [ever(item, CALM) for item in rules.firsts], atol=1e-12)
    assert worth.max() <= bound(alone.situation, discount, 0, 300).value + 1e-9


@settings(deadline=None, max_examples=20)
@given(instances(most=3), st.integers(0, 2))
def test_where_every_item_is_played_the_bound_is_what_they_earn(
    instance: Instance, depth: int
) -> None:
    items = sum(instance.counts)
    case = replace(instance, plays=items).situation

    found = bound(case, 0.9, depth if items < 4 else 0, 300)

    worth = worth_for_ever(case, 0.9) @ case.count
    assert found.value == pytest.approx(worth, abs=1e-3)


@settings(deadline=None, max_examples=20)
@given(slates(most=3, most_plays=2), st.integers(0, 1))
def test_a_group_is_as_many_items(instance: Instance, depth: int) -> None:
    case = replace(instance, chosen=()).situation
    rows = np.repeat(np.arange(len(case.count)), case.count)
    one_by_one = replace(
        case,
        model=case.model[rows],
        belief=case.belief[rows],
        count=np.ones(len(rows), dtype=np.int64),
        rested=case.rested[rows],
    )

    found = bound(case, 0.9, depth, 300)

    assert found.value == pytest.approx(bound(one_by_one, 0.9, depth, 300).value)


def test_models_that_have_no_candidate_change_no_bound() -> None:
    models = random_models(3, [3, 4, 2])
    beliefs = np.random.default_rng(3).dirichlet(np.ones(3), 2)
    alone = situation(ModelSet.of(models[:1]), [0, 0], beliefs, [1, 3])
    among = situation(
        ModelSet.of(models[::-1]), [2, 2], np.pad(beliefs, ((0, 0), (0, 1))), [1, 3]
    )

    found: list[Bound] = [bound(case, 0.9, 1, 300) for case in (alone, among)]

    assert_allclose(found[0], found[1], atol=1e-9)


@settings(deadline=None, max_examples=20)
@given(slates(signals=(2, 3)), st.integers(0, 3))
def test_the_effort_is_counted_before_it_is_made(
    instance: Instance, depth: int
) -> None:
    case = instance.situation

    found = effort(case, depth, 300)

    moves = 0
    for m in np.unique(case.model).tolist():
        divisions = divisions_of(int(case.models.states[m]), 300)[-1]
        arm = subsidy.arm(case.models, m, divisions, 0.9)
        moves += arm.played.size + arm.rested.size
    told = max(len(instance.model(group).signals) for group in range(len(case.model)))
    assert found.moves == moves
    assert found.leaves == (len(case.model) * told) ** (depth * instance.plays)
