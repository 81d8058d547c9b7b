"""Whittle's index and values in tables, against closed forms and lists of all beliefs.

What is published of bandits whose state is seen also while they rest (Avrachenkov and
Borkar 2020, arXiv:2004.14427; Nino-Mora) does not apply: here, only plays tell.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn
from numpy.testing import assert_allclose

from policies import (
    Floats,
    IndexTable,
    Model,
    ModelSet,
    Signals,
    Tables,
    build,
    grid,
    index,
)
from policies.relaxation import priced_value, relaxed
from tests.policies.alone import chain, gittins
from tests.policies.instances import (
    NOT_INDEXABLE,
    paper,
    random_model,
    telling_model,
)

MEDIUM = np.eye(4)[1]
SEEDS = st.integers(0, 2**32)


@cache
def tables(example: int) -> list[IndexTable]:
    models = ModelSet.of(paper(example))
    return [build(models, m, 0.95) for m in range(5)]


def looked_up(table: IndexTable, beliefs: Floats) -> Floats:
    """Return Whittle's index of each belief."""
    layers = Tables.of([table], table.discount).whittle
    rows = np.zeros(len(beliefs), dtype=np.int64)
    function = index.tabled(layers, table.states)
    return index.values(function, 0, rows, np.ascontiguousarray(beliefs))


def indices(model: Model, discount: float, beliefs: Floats, points: int) -> Floats:
    return looked_up(build(ModelSet.of([model]), 0, discount, points), beliefs)


def plain(
    play: object, rest: object, like: Sequence[float] | Floats, prior: object
) -> Model:
    names = [f"s{i}" for i in range(len(like))]
    return Model(names, play, rest, like, prior)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("example", "expected", "tolerance"),
    [
        (1, [0.695, 0.440, 0.5495, 0.4418, 0.547], 0.002),
        (2, [0.4826, 0.2254, 0.5250, 0.4481, 0.4394], 0.0004),
        (3, [0.6547, 0.5891, 0.6478, 0.5152, 0.6542], 0.0003),
    ],
)
def test_indices_of_the_paper_at_first(
    example: int, expected: list[float], tolerance: float
) -> None:
    """As another implementation found them, on grids of up to 60 divisions."""
    found = [
        looked_up(table, model.prior[None])[0]
        for table, model in zip(tables(example), paper(example), strict=True)
    ]

    assert_allclose(found, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("example", [1, 2, 3])
def test_examples_of_the_paper_are_indexable_on_the_beliefs_they_have(
    example: int,
) -> None:
    """Item 4 of example 1 and item 3 of example 2 are not, on beliefs they never have.

    An index moves by less than .01 when its grid is refined for the last time.
    """
    for number, table in enumerate(tables(example), start=1):
        assert table.indexable
        assert table.unsettled == 0
        never = (example, number) in {(1, 4), (2, 3)}
        assert (table.unsettled_elsewhere > 0) == never
        assert 0 < table.reached < len(table.whittle) / 10
        assert table.error < 0.01


def test_after_a_rest_the_index_of_example_three_is_the_best_time_to_play_on() -> None:
    """To rest is to be medium again; whoever plays then, plays for ever (Gittins)."""
    models = paper(3)
    found = [looked_up(table, MEDIUM[None])[0] for table in tables(3)]

    kept = [np.eye(4) - 0.95 * model.play for model in models]
    for_ever = [
        0.05 * float(MEDIUM @ np.linalg.solve(each, model.like))
        for each, model in zip(kept, models, strict=True)
    ]
    published = [0.612400, 0.577689, 0.616769, 0.512003, 0.611359]
    assert_allclose(for_ever, published, rtol=0, atol=5e-7)
    assert_allclose(found, for_ever, rtol=0, atol=2e-5)


@pytest.mark.parametrize(
    ("discount", "of_four", "of_many"),
    [(0.9, 0.69192, 0.7029), (0.95, 0.74627, 0.7614), (0.99, 0.83433, 0.8699)],
)
def test_where_interest_never_moves_it_is_gittins_index(
    discount: float, of_four: float, of_many: float
) -> None:
    """With many states it is the published one of a Bernoulli arm, b = .9: .7029.

    Gittins, Glazebrook and Weber (2011), table 8.1. A grid has no room for as many
    states, so that four are compared with the same oracle.
    """
    many = (np.arange(400) + 0.5) / 400
    assert gittins(many, np.full(400, 1 / 400), discount) == pytest.approx(
        of_many, abs=6e-5
    )
    like, beliefs = np.array([0.125, 0.375, 0.625, 0.875]), [np.full(4, 0.25)]
    for chances in (like, 1 - like, like):
        weights = beliefs[-1] * chances
        beliefs.append(weights / weights.sum())
    expected = [gittins(like, belief, discount) for belief in beliefs]
    assert expected[0] == pytest.approx(of_four, abs=6e-6)

    model = plain(np.eye(4), np.eye(4), like, beliefs[0])
    found = indices(model, discount, np.array(beliefs), 300)

    assert_allclose(found, expected, rtol=0, atol=0.02)


def liu_zhao(up: float, stay: float, beta: float, belief: float) -> float:
    """Return the index of a channel that is sensed: good after bad `up`, or `stay`.

    Liu and Zhao (2010), "Indexability of restless bandit problems and optimality of
    Whittle index for dynamic multichannel access", theorems 4 and 5, positively
    correlated; and the one case of negatively correlated channels without orbits.
    """

    def rested(good: float) -> float:
        return good * stay + (1 - good) * up

    low, high = min(up, stay), max(up, stay)
    if not low < belief < high:
        return belief
    if up > stay:
        assert belief >= rested(stay)
        ahead = beta * up + belief * (1 - beta)
        return ahead / (1 + beta * (up - belief))
    if belief >= up / (1 - stay + up):
        return belief / (1 - beta * stay + beta * belief)
    crossing, orbit = 0, up
    while orbit <= belief:
        crossing, orbit = crossing + 1, rested(orbit)
    kept = 1 - beta * stay
    total = kept * (1 - beta ** (crossing + 1))
    total += (1 - beta) * beta ** (crossing + 1) * orbit
    rests = kept * (1 - beta**crossing) / total
    plays = beta**crossing * orbit / total
    gain = belief - beta * rested(belief)
    spread = beta * kept - beta * gain
    return (gain + plays * (1 - beta) * spread) / (kept - rests * spread)


def channel_index(up: float, stay: float, beta: float, belief: float) -> float:
    """Return the tabled index of a belief that the prior leads to: it is the prior."""
    moves = [[1 - up, up], [1 - stay, stay]]
    prior = np.array([1 - belief, belief])
    model = plain(moves, moves, [0.0, 1.0], prior)
    return float(indices(model, beta, prior[None], 2_100)[0])


@pytest.mark.parametrize(
    ("up", "stay", "beta", "beliefs", "expected"),
    [
        (
            *(0.2, 0.8, 0.9),
            [0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85],
            [0.15, 0.282297, 0.439317, 0.60211, 0.709677, 0.751445, 0.78534, 0.85],
        ),
        (
            *(0.8, 0.3, 0.9),
            [0.35, 0.45, 0.5, 0.55, 0.6, 0.7, 0.75],
            [0.366492, 0.520231, 0.609756, 0.677448, 0.684511, 0.724771, 0.760766],
        ),
    ],
)
def test_indices_of_channels_are_known(
    up: float, stay: float, beta: float, beliefs: list[float], expected: list[float]
) -> None:
    """The second ones, negatively correlated, were computed on their finite states."""
    found = [channel_index(up, stay, beta, belief) for belief in beliefs]

    assert_allclose(found, expected, rtol=0, atol=1e-4)


@settings(deadline=None, max_examples=60)
@given(
    st.floats(0.05, 0.95),
    st.floats(0.05, 0.95),
    st.floats(0, 1),
    st.sampled_from([0.5, 0.8, 0.9, 0.95]),
)
def test_the_index_of_a_channel_is_liu_and_zhaos(
    up: float, stay: float, share: float, beta: float
) -> None:
    rested = stay * stay + (1 - stay) * up
    belief = share if up <= stay else rested + share * (1 - rested)

    found = channel_index(up, stay, beta, belief)

    expected = liu_zhao(up, stay, beta, belief)
    assert found == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize(
    ("up", "stay", "like", "beta", "expected"),
    [
        (
            *(0.2, 0.9, [0.1, 0.9], 0.95),
            [-0.052, 0.05252, 0.159546, 0.256982, 0.340162, 0.408346, 0.462697],
        ),
        (
            *(0.1, 0.8, [0.3, 0.7], 0.9),
            [0.264, 0.29212, 0.320196, 0.345135, 0.365924, 0.382574, 0.395551],
        ),
    ],
)
def test_the_index_of_what_a_play_resets_rises_with_rest(
    up: float, stay: float, like: list[float], beta: float, expected: list[float]
) -> None:
    """With f(k), the reward after k rests: from k on, play whenever k rests are over.

    W(k) = (f(k) (1 - b^(k+2)) - b f(k+1) (1 - b^(k+1))) / (1 - b)
    """
    rest = np.array([[1 - up, up], [1 - stay, stay]])
    beliefs = [np.array([1.0, 0.0])]
    while len(beliefs) < len(expected) + 1:
        beliefs.append(beliefs[-1] @ rest)
    earned, k = np.array(beliefs) @ like, np.arange(len(expected))
    closed = earned[:-1] * (1 - beta ** (k + 2)) - beta * earned[1:] * (
        1 - beta ** (k + 1)
    )
    assert_allclose(closed / (1 - beta), expected, rtol=0, atol=6e-7)
    model = plain([[1, 0], [1, 0]], rest, like, [1, 0])

    found = indices(model, beta, np.array(beliefs[:-1]), 2_100)

    assert_allclose(found, expected, rtol=0, atol=1e-4)


@st.composite
def listed(draw: DrawFn) -> tuple[Model, float]:
    """Models of few beliefs, each with a discount.

    A play tells all, or leads to one and the same belief, or both; of those that tell
    all, a rest may lead to one and the same belief.
    """
    rng = np.random.default_rng(draw(SEEDS))
    size = draw(st.integers(2, 3))
    model = telling_model(rng, size, draw(st.integers(1, 3)))
    play, rest = model.play, 0.8 * model.rest + 0.2 / size
    told = Signals(model.states, np.eye(size), rng.random(size))
    kind = draw(st.sampled_from(["told", "reset", "told and reset", "told or reset"]))
    signals = Signals(model.signals, model.observe, model.reward)
    if kind != "reset":
        signals = told
    if kind in ("reset", "told and reset"):
        play = np.tile(play[0], (size, 1))
    if kind == "told or reset":
        rest = np.tile(rest[0], (size, 1))
    made = Model(model.states, play, rest, None, model.prior, signals)
    return made, draw(st.sampled_from([0.0, 0.5, 0.9]))


@settings(deadline=None, max_examples=30)
@given(listed())
def test_the_index_is_where_resting_becomes_best_on_all_beliefs_there_are(
    case: tuple[Model, float],
) -> None:
    model, discount = case
    exact = chain(model, [model.prior, *model.play], discount)
    rows = list(range(len(model.play) + 1))
    table = build(ModelSet.of([model]), 0, discount, 5_000)

    found = looked_up(table, exact.beliefs[rows])

    assert table.indexable
    expected = [exact.index(row) for row in rows]
    assert_allclose(found, expected, rtol=0, atol=max(2 * table.error, 2e-3))


@settings(deadline=None, max_examples=40)
@given(listed(), st.floats(0, 1))
def test_values_are_upper_bounds_and_close(
    case: tuple[Model, float], share: float
) -> None:
    """At any price, below the least and above the greatest index, too."""
    model, discount = case
    models = ModelSet.of([model])
    exact = chain(model, [model.prior, *model.play], discount)
    table = build(models, 0, discount, 2_000)
    relaxation = relaxed(models, Tables.of([table], discount))
    spread = table.high - table.low
    price = table.low - 0.1 + share * (spread + 0.2)
    rows = np.zeros(len(exact.beliefs), dtype=np.int64)

    value = index.values(priced_value(relaxation, price), 0, rows, exact.beliefs)

    expected = exact.worth(price)
    assert (value >= expected - 1e-9).all()
    assert_allclose(value, expected, rtol=0, atol=0.02 * spread / (1 - discount) + 1e-6)


def value_between(
    model: Model, subsidy: float, discount: float, plays: int
) -> tuple[float, float]:
    """Bound V of the prior by all futures of some slots, and the worst and best after.

    Belief weights are not normalised: the chance of a future is their sum.
    """
    told = [model.observe[:, [y]] * model.play for y in range(len(model.signals))]
    futures = [model.prior[None]]
    for _ in range(plays):
        here = futures[-1]
        after = [here @ moves for moves in (model.rest, *told)]
        futures.append(np.stack(after, axis=1).reshape(-1, len(model.states)))
    worst, best = (
        max(subsidy, float(least)) / (1 - discount)
        for least in (model.like.min(), model.like.max())
    )
    bounds = []
    for tail in (worst, best):
        value = futures[-1].sum(axis=1) * tail
        for here in reversed(futures[:-1]):
            branches = discount * value.reshape(len(here), -1)
            played = here @ model.like + branches[:, 1:].sum(axis=1)
            value = np.maximum(played, here.sum(axis=1) * subsidy + branches[:, 0])
        bounds.append(float(value[0]))
    return bounds[0], bounds[1]


@settings(deadline=None, max_examples=30)
@given(SEEDS, st.integers(2, 5), st.integers(1, 2), st.floats(0, 1))
def test_no_way_to_play_and_rest_earns_more_than_the_value(
    seed: int, size: int, signals: int, share: float
) -> None:
    """And the value is no more than the best of nine slots and all that may follow."""
    model = telling_model(np.random.default_rng(seed), size, signals)
    models = ModelSet.of([model])
    table = build(models, 0, 0.5, 1_000)
    relaxation = relaxed(models, Tables.of([table], 0.5))
    price = table.low + share * (table.high - table.low)

    priced = priced_value(relaxation, price)
    value = index.values(priced, 0, np.zeros(1, dtype=np.int64), model.prior[None])[0]

    lowest, highest = value_between(model, price, 0.5, 9)
    assert lowest - 1e-9 <= value <= highest + 0.01


@settings(deadline=None, max_examples=12)
@given(SEEDS, st.integers(2, 4), st.floats(0.05, 1), st.floats(0, 1))
def test_the_index_scales_and_shifts_with_rewards(
    seed: int, size: int, scale: float, share: float
) -> None:
    model = random_model(np.random.default_rng(seed), size)
    shift = share * (1 - scale)
    other = told_and_paid(model, scale * model.like + shift)

    beliefs = grid.beliefs(size, 4)

    found = indices(other, 0.9, beliefs, 400)

    expected = indices(told_and_paid(model, model.like), 0.9, beliefs, 400)
    assert_allclose(found, scale * expected + shift, rtol=0, atol=0.004)


def told_and_paid(model: Model, like: Floats) -> Model:
    """Return the model with other rewards, whose plays tell all."""
    signals = Signals(model.states, np.eye(len(like)), like)
    return Model(model.states, model.play, model.rest, None, model.prior, signals)


@settings(deadline=None, max_examples=12)
@given(SEEDS, st.integers(2, 4))
def test_states_in_another_order_have_the_same_index(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    model, order = random_model(rng, size), rng.permutation(size)
    turned = plain(
        model.play[np.ix_(order, order)],
        model.rest[np.ix_(order, order)],
        model.like[order],
        model.prior[order],
    )

    found = indices(turned, 0.9, turned.prior[None], 900)

    expected = indices(model, 0.9, model.prior[None], 900)
    assert_allclose(found, expected, rtol=0, atol=0.01)


@settings(deadline=None, max_examples=12)
@given(SEEDS, st.integers(2, 4), st.sampled_from([0.0, 0.5, 0.95]))
def test_where_the_index_is_the_expected_reward(
    seed: int, size: int, discount: float
) -> None:
    """All moves alike, so that no play changes what follows; or nothing follows."""
    model = random_model(np.random.default_rng(seed), size)
    row = np.tile(model.play[0], (size, 1))
    play, rest = (row, row) if discount else (model.play, model.rest)
    same = plain(play, rest, model.like, model.prior)
    beliefs = np.random.default_rng(seed).dirichlet(np.ones(size), 20)

    found = indices(same, discount, beliefs, 400)

    assert_allclose(found, beliefs @ model.like, rtol=0, atol=1e-6)


@settings(deadline=None, max_examples=12)
@given(SEEDS, st.integers(2, 4), st.floats(0, 1))
def test_where_all_states_pay_the_same_the_index_is_that(
    seed: int, size: int, pay: float
) -> None:
    model = random_model(np.random.default_rng(seed), size)
    flat = plain(model.play, model.rest, np.full(size, pay), model.prior)

    table = build(ModelSet.of([flat]), 0, 0.9, 400)

    assert_allclose(table.whittle, pay, rtol=0, atol=1e-9)
    assert table.indexable


def test_company_changes_no_bit_of_a_table() -> None:
    """Models of more states, and of more signals, in the same set."""
    rng = np.random.default_rng(5)
    model = random_model(rng, 3)
    company = [telling_model(rng, 4, 5), model, random_model(rng, 2)]

    alone = build(ModelSet.of([model]), 0, 0.9, 400)
    among = build(ModelSet.of(company), 1, 0.9, 400)

    assert (alone.whittle == among.whittle).all()
    assert (alone.value == among.value).all()
    assert (alone.low, alone.high) == pytest.approx((among.low, among.high))


def test_a_model_is_indexable_or_not_on_the_beliefs_that_its_prior_leads_to() -> None:
    """To the states of one that is not indexable a fourth is added, which stays."""
    exact = chain(NOT_INDEXABLE, [np.eye(3)[1]], 0.9)
    gain = [exact.advantage(subsidy)[0] for subsidy in (0.1, 0.5, 0.9)]
    assert gain[0] > 0 > gain[1]
    assert gain[2] > 0
    play, rest = np.eye(4), np.eye(4)
    play[:3, :3], rest[:3, :3] = NOT_INDEXABLE.play, NOT_INDEXABLE.rest
    names = ("a", "b", "c", "d")
    signals = Signals(names, np.eye(4), [*NOT_INDEXABLE.reward, 0.3])

    there, elsewhere = (
        build(
            ModelSet.of([Model(names, play, rest, None, prior, signals)]), 0, 0.9, 300
        )
        for prior in (np.eye(4)[1], np.eye(4)[3])
    )

    assert not there.indexable
    assert (there.reached, elsewhere.reached) == (3, 1)
    assert there.unsettled > 0
    assert elsewhere.indexable
    assert elsewhere.unsettled == 0
    assert elsewhere.unsettled_elsewhere == there.unsettled + there.unsettled_elsewhere
    assert looked_up(elsewhere, np.eye(4)[3:])[0] == pytest.approx(0.3)
