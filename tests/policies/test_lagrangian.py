"""The price of rest, and scores by it, against lists of all beliefs and plain sums."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    ALONE,
    Floats,
    Model,
    ModelSet,
    Signals,
    Situation,
    Tables,
    bound,
    build,
    build_all,
    create,
    grid,
    index,
)
from policies.relaxation import (
    Relaxation,
    least_of,
    priced_advantage,
    priced_value,
    relaxed,
)
from tests.policies.alone import chain
from tests.policies.instances import (
    NOT_INDEXABLE,
    Instance,
    paper,
    paper_situation,
    random_model,
    random_models,
    rough_tables,
    situation,
    slates,
)

SEEDS = st.integers(0, 2**32)


def scores(name: str, case: Situation, discount: float, tables: Tables) -> Floats:
    policy = create(name, {"discount": discount})
    found = policy.prepare(case.models, tables)(case, 0)
    assert isinstance(found, np.ndarray)
    return found


def bound_at(case: Situation, relaxation: Relaxation, price: float) -> float:
    """Return L, as its formula says."""
    value = index.values(priced_value(relaxation, price), 0, case.model, case.belief)
    resting = case.count.sum() - case.slate.plays
    return float(value @ case.count - price * resting / (1 - relaxation.discount))


@settings(deadline=None, max_examples=40)
@given(slates(most_plays=2), st.sampled_from([0.0, 0.5, 0.9]))
def test_at_no_price_is_the_bound_lower(drawn: Instance, discount: float) -> None:
    """And it is convex in the price, within the range of each model."""
    plays = min(drawn.plays, sum(drawn.counts))
    case = replace(drawn, plays=plays, chosen=()).situation
    relaxation = relaxed(case.models, rough_tables(case.models, discount))

    price, found = least_of(relaxation, case)

    width = relaxation.high.max() - relaxation.low.min()
    prices = np.linspace(price - width, price + width, 301)
    around = [bound_at(case, relaxation, float(near)) for near in prices]
    assert found == pytest.approx(bound_at(case, relaxation, price), abs=1e-9)
    precise = 1e-6 * width / (1 - discount)  # of an item's value
    assert min(around) >= found - precise - 1e-9
    assert (np.diff(around, 2) >= -4 * precise * case.count.sum() - 1e-9).all()


@pytest.mark.parametrize("example", [1, 2, 3])
def test_the_bound_by_tables_is_one_and_near(example: int) -> None:
    """Between the prices of tables it is drawn straight, and so somewhat higher."""
    case = paper_situation(example)
    relaxation = relaxed(case.models, build_all(case.models, 0.95, 1_800))

    found = least_of(relaxation, case)

    exact = bound(case, 0.95, 0, 1_800)
    assert exact.value - 1e-6 <= found.bound <= exact.value + 0.04
    assert found.price == pytest.approx(exact.price, abs=0.02)


@settings(deadline=None, max_examples=30)
@given(SEEDS, st.integers(2, 4), st.floats(-0.1, 1.1))
def test_the_advantage_is_what_a_play_is_worth_more_than_a_rest(
    seed: int, size: int, share: float
) -> None:
    """By the values of the beliefs that follow, at the points of their grid."""
    model = random_model(np.random.default_rng(seed), size)
    models = ModelSet.of([model])
    tables = rough_tables(models, 0.9)
    relaxation = relaxed(models, tables)
    price = float(tables.low[0] + share * (tables.high[0] - tables.low[0]))
    beliefs = grid.beliefs(size, int(tables.value.divisions[0]))

    def looked_up(function: Callable[..., index.Index], points: Floats) -> Floats:
        rows = np.zeros(len(points), dtype=np.int64)
        return index.values(function(relaxation, price), 0, rows, points)

    found = looked_up(priced_advantage, beliefs)

    played = beliefs @ model.like
    for chances in model.observe.T:
        weights = (beliefs * chances) @ model.play
        told = weights.sum(axis=1)
        after = weights / np.maximum(told, 1e-300)[:, None]
        played += 0.9 * told * looked_up(priced_value, after)
    rested = price + 0.9 * looked_up(priced_value, beliefs @ model.rest)
    assert_allclose(found, played - rested, rtol=0, atol=1e-9)


def told_model(rng: np.random.Generator, size: int) -> Model:
    """A model whose plays tell its state and which forgets: its beliefs are few."""
    model = random_model(rng, size)
    signals = Signals(model.states, np.eye(size), model.like)
    rest = 0.8 * model.rest + 0.2 / size
    return Model(model.states, model.play, rest, None, model.prior, signals)


@settings(deadline=None, max_examples=12)
@given(SEEDS, st.sampled_from([0.5, 0.9]), st.integers(1, 3))
def test_scores_are_advantages_at_the_price_at_which_the_bound_is_least(
    seed: int, discount: float, plays: int
) -> None:
    rng = np.random.default_rng(seed)
    made = [told_model(rng, 2) for _ in range(3)]
    exact = [chain(model, [model.prior], discount) for model in made]
    counts = np.array([1, 2, 1])
    instance = Instance(
        tuple(made), (0, 1, 2), tuple(m.prior for m in made), (1, 2, 1), plays=plays
    )
    case = instance.situation
    tables = build_all(case.models, discount, 600)
    relaxation = relaxed(case.models, tables)

    found = scores("lagrangian", case, discount, tables)

    def total(price: float) -> float:
        value = np.array([each.worth(price)[0] for each in exact])
        return float(value @ counts - price * (4 - plays) / (1 - discount))

    prices = np.linspace(relaxation.low.min(), relaxation.high.max(), 101)
    price = least_of(relaxation, case).price
    assert total(price) <= min(total(float(other)) for other in prices) + 0.01
    expected = [each.advantage(price)[0] for each in exact]
    assert_allclose(found, expected, rtol=0, atol=0.02)


@settings(deadline=None, max_examples=30)
@given(slates(signals=(2, 3)))
def test_items_chosen_already_count_in_the_price(instance: Instance) -> None:
    case = instance.situation
    tables = rough_tables(case.models, 0.9)
    chosen = [
        Instance(instance.models, (row,), (belief,), (1,)).situation
        for row, belief in instance.chosen
    ]
    whole = replace(
        case,
        model=np.concatenate([case.model, *(each.model for each in chosen)]),
        belief=np.concatenate([case.belief, *(each.belief for each in chosen)]),
        count=np.concatenate([case.count, *(each.count for each in chosen)]),
        rested=np.concatenate([case.rested, *(each.rested for each in chosen)]),
        slate=replace(ALONE, plays=instance.plays),
    )

    found = scores("lagrangian", case, 0.9, tables)

    expected = scores("lagrangian", whole, 0.9, tables)
    assert_array_equal(found, expected[: len(found)])


@pytest.mark.parametrize(("example", "first"), [(1, 0), (2, 2), (3, 0)])
def test_whittle_and_lagrangian_first_play_what_is_best_in_the_paper(
    example: int, first: int
) -> None:
    case = paper_situation(example)
    tables = build_all(case.models, 0.95, 1_800)

    for name in ("whittle", "lagrangian"):
        assert scores(name, case, 0.95, tables).argmax() == first


def test_whittle_scores_are_the_tabled_indices_of_each_model() -> None:
    models = ModelSet.of([*random_models(1, [2, 4]), *paper(1)[:1]])
    built = [build(models, m, 0.9, 300) for m in range(3)]
    beliefs = [grid.beliefs(table.states, table.divisions)[5] for table in built]
    instance = Instance(
        (*random_models(1, [2, 4]), *paper(1)[:1]), (2, 0, 1), (), (1, 1, 1)
    )
    case = situation(
        models,
        instance.rows,
        np.array([np.pad(beliefs[m], (0, 4 - len(beliefs[m]))) for m in (2, 0, 1)]),
        instance.counts,
    )

    found = scores("whittle", case, 0.9, Tables.of(built, 0.9))

    assert_allclose(found, [built[m].whittle[5] for m in (2, 0, 1)], atol=1e-12)


def test_where_a_model_is_not_indexable_whittle_is_the_lagrangian() -> None:
    """Also for items of other models."""
    rng = np.random.default_rng(2)
    models = ModelSet.of([NOT_INDEXABLE, random_model(rng, 3)])
    case = situation(models, [0, 1, 1], rng.dirichlet(np.ones(3), 3), [2, 1, 1])
    tables = rough_tables(models, 0.9)

    found = scores("whittle", case, 0.9, tables)

    assert not tables.indexable
    assert_array_equal(found, scores("lagrangian", case, 0.9, tables))
    others = rough_tables(ModelSet.of(random_models(2, [3, 3])), 0.9)
    assert others.indexable
