"""Exact rollout, against a recursion over all answers, item by item."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    NEVER,
    NO_TABLES,
    Floats,
    Ints,
    Mixture,
    Model,
    ModelSet,
    Signals,
    Situation,
    Tables,
)
from policies.base import Base
from policies.exact_rollout import ExactRollout
from policies.lagrangian import Lagrangian
from policies.relaxation import least, relaxed
from tests.policies.instances import (
    NOT_INDEXABLE,
    Instance,
    instances,
    moods,
    paper_instance,
    paper_situation,
    random_model,
    random_models,
    rough_tables,
    situation,
    slates,
    telling_model,
)
from tests.policies.oracles import CALM, exact_scores
from tests.policies.rules import Rules

MYOPIC = ExactRollout(base="myopic", leaf="none")
PLAIN: Sequence[Base] = ("myopic", "best_fixed", "round_robin")
TABLED: Sequence[Base] = ("whittle", "lagrangian", "myopic")
Leaf: TypeAlias = Literal["none", "base", "lagrangian"]
LEAVES: Sequence[Leaf] = ("none", "base", "lagrangian")


def score(
    policy: ExactRollout, case: Situation, tables: Tables = NO_TABLES, *, prune: bool
) -> Floats:
    scores = policy.prepare(case.models, tables, prune)(case, 0)
    assert not isinstance(scores, Mixture)
    return scores


@st.composite
def rollouts(
    draw: DrawFn, bases: Sequence[Base], leaves: Sequence[Leaf], most: int = 1
) -> ExactRollout:
    """Rollouts of one to three bases, whose trees are small or `most` times deeper."""
    depth = draw(st.integers(1, 3))
    names = draw(st.lists(st.sampled_from(bases), min_size=1, max_size=3, unique=True))
    leaf, longest = draw(st.sampled_from(leaves)), most * {1: 4, 2: 2, 3: 1}[depth]
    if leaf == "lagrangian":  # further, few plays may have more than FEW_FUTURES
        longest = min(longest, 3)
    return ExactRollout(
        base=tuple(names) if len(names) > 1 else names[0],
        horizon=draw(st.integers(1, longest)),
        depth=depth,
        leaf=leaf,
        discount=draw(st.sampled_from([0.0, 0.5, 0.95])),
    )


def expected(policy: ExactRollout, instance: Instance, tables: Tables) -> list[float]:
    rules = Rules(instance, tables, policy.discount)
    plan = rules.plan(policy.bases, policy.horizon, policy.depth, policy.leaf)
    return exact_scores(plan, instance, by_rest=policy.rest_matters)


@settings(deadline=None, max_examples=60)
@given(rollouts(PLAIN, LEAVES[:2]), slates(most=3, signals=(1, 2, 3)))
def test_scores_are_sums_over_all_answers(
    policy: ExactRollout, instance: Instance
) -> None:
    scores = score(policy, instance.situation, prune=False)

    assert_allclose(scores, expected(policy, instance, NO_TABLES), rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=60)
@given(
    rollouts((*PLAIN, *TABLED[:2]), LEAVES), moods(slates(most=3, signals=(1, 2, 3)))
)
def test_scores_are_sums_over_all_answers_in_the_moods_they_lead_to(
    policy: ExactRollout, instance: Instance
) -> None:
    case = instance.situation
    tables = rough_tables(case.models, policy.discount)

    scores = score(policy, case, tables, prune=False)
    pruned = score(policy, case, tables, prune=True)

    exact = expected(policy, instance, tables)
    assert_allclose(scores, exact, rtol=0, atol=1e-11)
    assert_allclose(pruned.max(), max(exact), rtol=0, atol=1e-11)
    assert (pruned >= scores - 1e-11).all()


@settings(deadline=None, max_examples=40)
@given(rollouts(TABLED, LEAVES), slates(most=3, signals=(2, 3)))
def test_scores_by_tables_are_sums_over_all_answers(
    policy: ExactRollout, instance: Instance
) -> None:
    case = instance.situation
    tables = rough_tables(case.models, policy.discount)

    scores = score(policy, case, tables, prune=False)

    assert_allclose(scores, expected(policy, instance, tables), rtol=0, atol=1e-11)


def test_where_a_model_is_not_indexable_a_base_goes_by_the_lagrangian() -> None:
    rng = np.random.default_rng(1)
    models = (NOT_INDEXABLE, random_model(rng, 3))
    beliefs = tuple(rng.dirichlet(np.ones(3), 3))
    instance = Instance(models, (0, 0, 1), beliefs, (1, 2, 1))
    case = instance.situation
    tables = rough_tables(case.models, 0.9)
    assert not tables.indexable
    lagrangian, whittle, both = (
        ExactRollout(base=base, horizon=3, discount=0.9)
        for base in ("lagrangian", "whittle", ("whittle", "lagrangian"))
    )

    scores = score(lagrangian, case, tables, prune=False)

    assert_allclose(scores, expected(whittle, instance, tables), atol=1e-12)
    assert_array_equal(score(whittle, case, tables, prune=False), scores)
    assert_array_equal(score(both, case, tables, prune=False), scores)


@pytest.mark.parametrize("example", [1, 2, 3])
def test_scores_of_the_paper(example: int) -> None:
    policy = replace(MYOPIC, horizon=5)

    scores = score(policy, paper_situation(example), prune=False)

    oracle = expected(policy, paper_instance(example), NO_TABLES)
    assert_allclose(scores, oracle, rtol=0, atol=1e-12)
    if example == 1:
        known = [3.53666157, 3.30837371, 3.41343076, 3.30837371, 3.40664325]
        assert_allclose(scores, known, rtol=0, atol=5e-9)


@pytest.mark.parametrize(
    ("plays", "worth"), [(2, 1.21720187), (5, 2.98905286), (10, 5.48314754)]
)
def test_playing_the_myopic_item_first_is_myopic_play(plays: int, worth: float) -> None:
    policy = replace(MYOPIC, horizon=plays - 1)

    scores = score(policy, paper_situation(1), prune=False)

    assert scores[0] == pytest.approx(worth, abs=5e-9)


def test_the_optimum_of_example_two_is_item_three_once_then_item_four() -> None:
    """An upper bound meets it: 8.986321."""
    policy = ExactRollout(base="best_fixed", leaf="base")

    scores = score(policy, paper_situation(2), prune=True)

    assert scores.argmax() == 2
    assert scores.max() == pytest.approx(8.986321013638, abs=1e-11)


def test_the_optimum_of_example_three_is_item_one_for_ever() -> None:
    """An upper bound meets it; item 5 would be followed by more than one item."""
    case = paper_situation(3)
    policy = ExactRollout(base="best_fixed", leaf="base")

    scores = score(policy, case, prune=False)

    optimal = [12.96312, 12.16361, 12.83550, 12.15361]
    assert_allclose(scores[:4], optimal, rtol=0, atol=5e-6)
    assert scores[4] == pytest.approx(12.5672, abs=1e-3)
    assert scores[0] == pytest.approx(12.963117368826, abs=1e-11)
    medium = replace(case, belief=np.tile(np.eye(4)[1], (5, 1)))
    at_rest = score(policy, medium, prune=True)
    assert at_rest.argmax() == 2
    assert at_rest.max() == pytest.approx(12.3353816, abs=5e-8)


@settings(deadline=None, max_examples=60)
@given(st.data(), slates(most=8, signals=(1, 2, 3)))
def test_pruning_changes_no_winner(data: st.DataObject, instance: Instance) -> None:
    policy = data.draw(rollouts((*PLAIN, *TABLED[:2]), LEAVES, most=2))
    case, tables = instance.situation, NO_TABLES
    if policy.table_discount is not None:
        tables = rough_tables(case.models, policy.discount)

    full = score(policy, case, tables, prune=False)
    pruned = score(policy, case, tables, prune=True)

    assert_array_equal(pruned == pruned.max(), full == full.max())
    assert_array_equal(pruned[full == full.max()], full.max())
    assert (pruned >= full - 1e-12).all()
    assert (pruned[pruned != full] < full.max()).all()


@pytest.mark.parametrize("depth", [1, 2])
@pytest.mark.parametrize("leaf", ["none", "base"])
def test_pruning_leaves_out_most_of_a_catalogue(depth: int, leaf: str) -> None:
    rng = np.random.default_rng(4)
    models = ModelSet.of([random_model(rng, 4) for _ in range(60)])
    case = situation(models, range(60), models.prior, [1] * 60)
    policy = ExactRollout("myopic", 4, depth, leaf, discount=0.6)  # type: ignore[arg-type]

    full = score(policy, case, prune=False)
    pruned = score(policy, case, prune=True)

    assert (pruned >= full).all()
    assert pruned.argmax() == full.argmax()
    assert (pruned > full).sum() > (30 if depth == 2 else 0)


@settings(deadline=None, max_examples=40)
@given(rollouts(PLAIN, LEAVES[:2]), slates(signals=(2, 3)))
def test_rest_matters_to_round_robin_only(
    policy: ExactRollout, instance: Instance
) -> None:
    case = instance.situation
    never = replace(case, rested=np.full(len(case.rested), NEVER))
    other = ExactRollout(
        base="myopic", horizon=policy.horizon, depth=policy.depth, leaf=policy.leaf
    )

    for each in (policy, other):
        if not each.rest_matters:
            scores = score(each, case, prune=False)
            assert_array_equal(score(each, never, prune=False), scores)


def test_round_robin_follows_with_what_has_rested_longest() -> None:
    """Models that earn the same in all states, so that a score tells which is next."""
    models = ModelSet.of(
        [
            Model(("a", "b"), np.eye(2), np.eye(2), [like, like], [1, 0])
            for like in (0.5, 0.25, 0.125)
        ]
    )
    case = situation(models, range(3), models.prior, [1, 1, 1])
    policy = ExactRollout(base="round_robin", horizon=1, leaf="none", discount=0.5)

    for rested, after in (([3, 9, 5], 0.25), ([9, 0, 12], 0.125), ([NEVER, 0, 12], 0)):
        recent = replace(case, rested=np.array(rested))
        scores = score(policy, recent, prune=False)
        if after:
            assert scores[0] == 0.5 + 0.5 * after
        else:
            assert_array_equal(scores[1:], [0.25 + 0.25, 0.125 + 0.25])


@settings(deadline=None, max_examples=60)
@given(slates(signals=(2, 3)), st.sampled_from(LEAVES[:2]), st.integers(1, 2))
def test_parallel_rollout_is_no_worse_than_the_rollout_of_any_base(
    instance: Instance, leaf: str, depth: int
) -> None:
    case = instance.situation

    def scores(*bases: Base) -> Floats:
        policy = ExactRollout(base=bases, horizon=3, depth=depth, leaf=leaf)  # type: ignore[arg-type]
        return score(policy, case, prune=False)

    together = scores(*PLAIN)

    for base in PLAIN:
        assert (together >= scores(base) - 1e-13).all()


@settings(deadline=None, max_examples=40)
@given(slates(signals=(2, 3)), st.sampled_from(LEAVES[:2]), st.sampled_from(PLAIN))
def test_looking_further_ahead_never_loses(
    instance: Instance, leaf: str, base: Base
) -> None:
    """As many plays, of which more are chosen by trying all of them."""
    case = instance.situation

    scores = [
        score(ExactRollout(base, 4 - depth, depth, leaf), case, prune=False)  # type: ignore[arg-type]
        for depth in (1, 2, 3)
    ]

    assert (scores[1] >= scores[0] - 1e-13).all()
    assert (scores[2] >= scores[1] - 1e-13).all()


@settings(deadline=None, max_examples=40)
@given(instances(signals=(2, 3)))
def test_rollout_earns_no_less_than_the_best_fixed_item(instance: Instance) -> None:
    """And neither does a rollout of it that goes on as it would play for ever."""
    case = instance.situation
    fixed = score(ExactRollout("best_fixed", leaf="base", horizon=1), case, prune=True)

    longer = score(ExactRollout("best_fixed", leaf="base"), case, prune=True)

    rules = Rules(instance, NO_TABLES, 0.95)
    leaf = rules.rule("best_fixed")
    worth = max(leaf(item, CALM) for item in rules.firsts)
    assert fixed.max() >= worth - 1e-12
    assert longer.max() >= fixed.max() - 1e-12


@settings(deadline=None, max_examples=30)
@given(instances(signals=(2, 3)), st.sampled_from(TABLED), st.integers(1, 3))
def test_no_score_exceeds_the_bound_that_is_its_leaf(
    instance: Instance, base: Base, depth: int
) -> None:
    case = instance.situation
    tables = rough_tables(case.models, 0.95)
    priced = least(relaxed(case.models, tables), case.model, case.belief, case.count, 1)
    policy = ExactRollout(base, 2, depth, "lagrangian")

    scores = score(policy, case, tables, prune=True)

    assert scores.max() <= priced.bound + 1e-6


@settings(deadline=None, max_examples=40)
@given(rollouts((*PLAIN, *TABLED[:2]), LEAVES), instances(signals=(2, 3)))
def test_without_a_future_it_is_myopic(
    policy: ExactRollout, instance: Instance
) -> None:
    case = instance.situation
    now = replace(policy, discount=0.0)
    tables = rough_tables(case.models, 0.0)

    scores = score(now, case, tables, prune=True)

    chances = [item.chance for item in Rules(instance, NO_TABLES, 0.0).firsts]
    assert_allclose(scores, chances, rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=30)
@given(
    rollouts(("myopic", "best_fixed"), LEAVES[:2]), slates(signals=(2, 3)), st.randoms()
)
def test_neither_order_nor_names_change_a_score(
    policy: ExactRollout, instance: Instance, random: object
) -> None:
    """Groups, models, states and signals in another order."""
    rng = np.random.default_rng(hash(random) % 2**32)

    turned, order = shuffled(instance, rng)

    assert_allclose(
        score(policy, turned.situation, prune=False),
        score(policy, instance.situation, prune=False)[order],
        rtol=0,
        atol=1e-12,
    )


def shuffled(
    instance: Instance, rng: np.random.Generator
) -> tuple[Instance, Sequence[int]]:
    """Return the same, and where its groups were before."""
    order = rng.permutation(len(instance.rows)).tolist()
    places = rng.permutation(len(instance.models)).tolist()
    states = [rng.permutation(len(model.states)) for model in instance.models]
    models = [
        renamed(
            instance.models[m],
            states[m],
            rng.permutation(len(instance.models[m].signals)),
        )
        for m in places
    ]
    return Instance(
        tuple(models),
        tuple(places.index(instance.rows[g]) for g in order),
        tuple(instance.beliefs[g][states[instance.rows[g]]] for g in order),
        tuple(instance.counts[g] for g in order),
        tuple(instance.since[g] for g in order),
        instance.plays,
        tuple(
            (places.index(row), belief[states[row]]) for row, belief in instance.chosen
        ),
    ), order


def renamed(model: Model, states: Ints, signals: Ints) -> Model:
    return Model(
        model.states,
        model.play[np.ix_(states, states)],
        model.rest[np.ix_(states, states)],
        None,
        model.prior[states],
        Signals(
            model.signals, model.observe[np.ix_(states, signals)], model.reward[signals]
        ),
    )


def test_there_are_never_more_than_4096_futures() -> None:
    rng = np.random.default_rng(3)
    three = ModelSet.of([telling_model(rng, 2, 3) for _ in range(3)])
    two = ModelSet.of(random_models(3, [2, 2, 2]))

    for models, most in ((three, 7), (two, 12)):
        case = situation(models, range(3), models.prior, [1, 1, 1])
        full, longer, shorter = (
            score(replace(MYOPIC, horizon=horizon), case, prune=False)
            for horizon in (most, 12, most - 1)
        )
        assert_array_equal(longer, full)
        assert (full > shorter).all()


def test_more_plays_a_slot_than_items_are_all_of_them() -> None:
    case = paper_situation(1)
    tables = rough_tables(case.models, 0.95)
    all_of_them, more = (
        replace(case, slate=replace(case.slate, plays=plays)) for plays in (5, 99)
    )

    for leaf in LEAVES:
        policy = ExactRollout(horizon=6, leaf=leaf)
        scores = score(policy, all_of_them, tables, prune=False)
        assert_allclose(score(policy, more, tables, prune=False), scores, atol=1e-6)


def test_a_slot_of_very_many_plays_goes_by_the_lagrangian() -> None:
    case = paper_situation(1)
    many = replace(case, count=np.full(5, 10), slate=replace(case.slate, plays=20))
    tables = rough_tables(case.models, 0.95)

    scores = score(ExactRollout(), many, tables, prune=True)

    lagrangian = Lagrangian().prepare(case.models, tables)(many, 0)
    assert_array_equal(scores, lagrangian)


def test_so_many_first_plays_are_not_tried_in_sequence() -> None:
    rng = np.random.default_rng(4)
    models = ModelSet.of([random_model(rng, 2) for _ in range(200)])
    case = situation(models, range(200), models.prior, [1] * 200)

    deep, plain = (
        score(ExactRollout("myopic", 2, depth, "none"), case, prune=False)
        for depth in (3, 1)
    )

    assert_array_equal(deep, plain)


@pytest.mark.parametrize(("depth", "horizon", "cut"), [(3, 12, 2), (2, 12, 7)])
def test_the_horizon_is_cut_where_too_much_would_be_imagined(
    depth: int, horizon: int, cut: int
) -> None:
    """With 20 beliefs and two signals: 40^D 2^H is at most 300 000."""
    models = ModelSet.of(random_models(5, [2] * 20))
    case = situation(models, range(20), models.prior, [1] * 20)

    asked, done = (
        score(replace(MYOPIC, depth=depth, horizon=plays), case, prune=True)
        for plays in (horizon, cut)
    )

    assert_array_equal(asked, done)


def test_a_slot_that_cannot_be_followed_deeply_is_followed_less_deeply() -> None:
    models = ModelSet.of(random_models(5, [2] * 20))
    tables = rough_tables(models, 0.95)
    case = situation(models, range(20), models.prior, [1] * 20)
    three = replace(case, slate=replace(case.slate, plays=3))
    deep, shallow = (
        ExactRollout(depth=depth, horizon=horizon)
        for depth, horizon in ((3, 6), (2, 7))
    )

    assert_array_equal(
        score(deep, three, tables, prune=True),
        score(shallow, three, tables, prune=True),
    )
