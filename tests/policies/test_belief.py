import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    LIKE,
    MOST_SURPRISE,
    NONE,
    SKIP,
    Floats,
    Model,
    ModelSet,
    answered,
    expected_like,
    forecast,
    replayed,
    rested,
    untouched,
)
from tests.policies.instances import paper, random_model, random_models
from tests.policies.oracles import Slot, enumerated_belief

SEEDS = st.integers(0, 2**32)
SIZES = st.integers(2, 5)
SIGNALS = st.sampled_from([LIKE, SKIP, NONE])


def rest(models: ModelSet, belief: Floats, slots: int) -> Floats:
    after: Floats = rested(models, np.array([0]), belief[None], np.array([slots]))[0]
    return after


def drawn(seed: int, size: int) -> tuple[Model, ModelSet, Floats]:
    rng = np.random.default_rng(seed)
    model = random_model(rng, size)
    return model, ModelSet.of([model]), rng.dirichlet(np.ones(size))


def test_unit_values_of_example_one() -> None:
    models = ModelSet.of(paper(1)[:1])
    prior = models.prior[0]

    liked = answered(models, 0, prior, LIKE)
    skipped = answered(models, 0, prior, SKIP)

    assert_allclose(
        liked.belief, [0.02542373, 0.07288136, 0.31694915, 0.58474576], atol=1e-8
    )
    assert_allclose(
        skipped.belief, [0.13414634, 0.28536585, 0.32439024, 0.25609756], atol=1e-8
    )
    assert_allclose(rest(models, prior, 1), [0.075, 0.195, 0.34, 0.39], atol=1e-15)
    assert liked.surprise == pytest.approx(-math.log(0.59))
    assert skipped.surprise == pytest.approx(-math.log(0.41))
    assert not liked.impossible


@pytest.mark.parametrize(
    ("example", "chances"),
    [
        (1, [0.59, 0.435, 0.54, 0.435, 0.55]),
        (2, [0.4, 0.225, 0.525, 0.435, 0.4375]),
        (3, [0.55, 0.445, 0.585, 0.435, 0.5875]),
    ],
)
def test_expected_likes_of_the_paper(example: int, chances: list[float]) -> None:
    models = ModelSet.of(paper(example))

    got = expected_like(models, np.arange(5), untouched(models, 0))

    assert_allclose(got, chances, atol=1e-15)


@settings(deadline=None, max_examples=40)
@given(
    SEEDS, st.integers(2, 3), st.lists(st.tuples(st.booleans(), SIGNALS), max_size=5)
)
def test_the_filter_is_the_sum_over_hidden_paths(
    seed: int, size: int, log: list[tuple[bool, int]]
) -> None:
    model, models, _ = drawn(seed, size)
    slots = [Slot(played, signal) for played, signal in log]
    plays = [t for t, slot in enumerate(slots) if slot.played]

    slot, belief = replayed(
        models,
        0,
        np.array(plays, dtype=np.int64),
        np.array([slots[t].signal for t in plays], dtype=np.int64),
    )

    assert slot == (plays[-1] + 1 if plays else 0)
    belief = rest(models, belief, len(slots) - slot)
    assert_allclose(belief, enumerated_belief(model, slots), atol=1e-12)


@settings(deadline=None)
@given(SEEDS, SIZES)
def test_an_answer_moves_no_belief_on_average(seed: int, size: int) -> None:
    model, models, belief = drawn(seed, size)
    chance = expected_like(models, np.array([0]), belief[None])[0]

    liked = answered(models, 0, belief, LIKE).belief
    skipped = answered(models, 0, belief, SKIP).belief

    mean = chance * liked + (1 - chance) * skipped
    assert_allclose(mean, belief @ model.play, atol=1e-14)
    assert_allclose(answered(models, 0, belief, NONE).belief, mean, atol=1e-14)


@settings(deadline=None)
@given(SEEDS, SIZES, SIGNALS, st.integers(0, 2**40))
def test_beliefs_stay_distributions(seed: int, size: int, signal: int, k: int) -> None:
    _, models, belief = drawn(seed, size)

    for after in (rest(models, belief, k), answered(models, 0, belief, signal).belief):
        assert (after >= 0).all()
        assert after.sum() == pytest.approx(1, abs=1e-12)


@settings(deadline=None)
@given(SEEDS, SIZES, st.integers(0, 2**20), st.integers(0, 2**20))
def test_rest_adds_up(seed: int, size: int, first: int, second: int) -> None:
    _, models, belief = drawn(seed, size)

    twice = rest(models, rest(models, belief, first), second)

    assert_allclose(rest(models, belief, first + second), twice, atol=1e-12)


@settings(deadline=None)
@given(SEEDS, SIZES, st.integers(0, 40))
def test_rest_is_a_power_of_the_matrix(seed: int, size: int, k: int) -> None:
    model, models, belief = drawn(seed, size)

    expected = belief @ np.linalg.matrix_power(model.rest, k)

    assert_allclose(rest(models, belief, k), expected, atol=1e-13)
    assert_allclose(
        untouched(models, k)[0],
        model.prior @ np.linalg.matrix_power(model.rest, k),
        atol=1e-13,
    )


def test_no_rest_changes_no_bit() -> None:
    _, models, belief = drawn(5, 4)

    assert_array_equal(rest(models, belief, 0), belief)


def test_each_belief_rests_by_its_own_model_and_slots() -> None:
    both = random_models(6, [3, 3])
    models = ModelSet.of(both)
    rows, slots = np.array([1, 0, 1]), np.array([3, 1, 0])
    belief = np.random.default_rng(6).dirichlet(np.ones(3), 3)
    before = belief.copy()

    after = rested(models, rows, belief, slots)

    for k in range(3):
        power = np.linalg.matrix_power(both[rows[k]].rest, int(slots[k]))
        assert_allclose(after[k], before[k] @ power, atol=1e-14)
    assert_array_equal(belief, before)


@settings(deadline=None)
@given(SEEDS, SIZES, st.lists(st.tuples(st.integers(0, 9), SIGNALS), max_size=12))
def test_a_replayed_log_equals_stepping_to_the_bit(
    seed: int, size: int, log: list[tuple[int, int]]
) -> None:
    _, models, _ = drawn(seed, size)
    belief, now = untouched(models, 0)[0], 0
    slots = []
    for gap, signal in log:
        belief = answered(models, 0, rest(models, belief, gap), signal).belief
        slots.append(now + gap)
        now += gap + 1

    slot, again = replayed(
        models,
        0,
        np.array(slots, dtype=np.int64),
        np.array([s for _, s in log], dtype=np.int64),
    )

    assert slot == now
    assert_array_equal(again, belief)


@settings(deadline=None)
@given(SEEDS, st.integers(0, 1000))
def test_an_untouched_belief_equals_a_rested_prior_to_the_bit(
    seed: int, slot: int
) -> None:
    models = ModelSet.of(random_models(seed, [2, 4]))

    expected = rested(models, np.arange(2), models.prior, np.full(2, slot))

    assert_array_equal(untouched(models, slot), expected)


@settings(max_examples=20, deadline=None)
@given(SEEDS, SIZES, st.floats(-8, 0), st.integers(0, 41).map(lambda k: 2**k - 1))
def test_rests_of_any_length_are_exact(
    seed: int, size: int, pace: float, slots: int
) -> None:
    """Also those of weeks in slots of seconds: against integers of 300 bits."""
    slow = slowed(random_model(np.random.default_rng(seed), size), 10**pace)
    models = ModelSet.of([slow])

    after = rest(models, models.prior[0], slots)

    assert_allclose(after, rested_exactly(models, slots), rtol=0, atol=2e-15)
    assert after.sum() == pytest.approx(1, abs=4e-15)


def slowed(model: Model, pace: float) -> Model:
    rest = np.eye(len(model.prior)) * (1 - pace) + model.rest * pace
    return Model(model.states, model.play, rest, model.like, model.prior)


def rested_exactly(models: ModelSet, slots: int) -> Floats:
    one = 1 << 300
    moves = [[int(Fraction(p) * one) for p in row] for row in models.rest[0].tolist()]
    moves = [[p * one // sum(row) for p in row] for row in moves]
    belief = [int(Fraction(p) * one) for p in models.prior[0].tolist()]
    states = range(len(belief))
    while slots:
        if slots & 1:
            belief = [
                sum(belief[i] * moves[i][j] for i in states) // one for j in states
            ]
        moves = [
            [sum(row[k] * moves[k][j] for k in states) // one for j in states]
            for row in moves
        ]
        slots >>= 1
    return np.array([p / one for p in belief])


@settings(deadline=None)
@given(SEEDS, SIZES)
def test_a_forecast_is_the_expected_like_after_rest(seed: int, size: int) -> None:
    _, models, belief = drawn(seed, size)

    expected = [
        expected_like(models, np.array([0]), rest(models, belief, k)[None])[0]
        for k in range(1, 8)
    ]

    assert_allclose(forecast(models, 0, belief, 7), expected, atol=1e-13)
    assert forecast(models, 0, belief, 0).shape == (0,)


@pytest.mark.parametrize(
    ("like", "signal"), [([0, 0], LIKE), ([1, 1], SKIP), ([5e-324, 0], LIKE)]
)
def test_an_impossible_signal_moves_the_belief_as_no_answer(
    like: list[float], signal: int
) -> None:
    play = [[0.9, 0.1], [0.2, 0.8]]
    models = ModelSet.of([Model(("a", "b"), play, play, like, [0.25, 0.75])])

    after = answered(models, 0, models.prior[0], signal)

    assert after.impossible
    assert after.surprise == MOST_SURPRISE
    assert math.isfinite(MOST_SURPRISE)
    assert_array_equal(after.belief, answered(models, 0, models.prior[0], NONE).belief)
    assert_allclose(after.belief, [0.375, 0.625])


@pytest.mark.parametrize(("like", "signal"), [([1, 1], LIKE), ([0, 0], SKIP)])
def test_a_certain_signal_is_no_surprise(like: list[float], signal: int) -> None:
    model = random_models(8, [3])[0]
    certain = Model(model.states, model.play, model.rest, [*like, like[0]], model.prior)
    models = ModelSet.of([certain])

    after = answered(models, 0, models.prior[0], signal)

    assert after.surprise == pytest.approx(0, abs=1e-15)
    assert after.surprise >= 0
    assert not after.impossible
    assert expected_like(models, np.array([0]), models.prior)[0] <= 1


def test_rounding_makes_no_chance_exceed_one() -> None:
    models = ModelSet.of([Model(("a", "b"), np.eye(2), np.eye(2), [1, 1], [0.5, 0.5])])
    belief = np.array([0.5, np.nextafter(0.5, 1) + 1e-16])

    assert belief.sum() > 1
    assert expected_like(models, np.array([0]), belief[None])[0] == 1
    assert answered(models, 0, belief, LIKE).surprise == 0


def test_no_answer_is_no_surprise() -> None:
    _, models, belief = drawn(9, 3)

    after = answered(models, 0, belief, NONE)

    assert (after.surprise, after.impossible) == (0.0, False)


@settings(deadline=None)
@given(SEEDS, SIGNALS, st.integers(0, 100))
def test_padding_changes_no_bit_of_a_belief(seed: int, signal: int, k: int) -> None:
    small, large = random_models(seed, [2, 5])
    alone, both = ModelSet.of([small]), ModelSet.of([large, small])
    wide = np.pad(small.prior, (0, 3))

    after = answered(alone, 0, rest(alone, small.prior, k), signal)
    rested_wide = rested(both, np.array([1]), wide[None], np.array([k]))[0]
    padded = answered(both, 1, rested_wide, signal)

    assert_array_equal(padded.belief, np.pad(after.belief, (0, 3)))
    assert padded.surprise == after.surprise


def test_read_only_and_strided_arrays_are_taken() -> None:
    _, models, belief = drawn(10, 4)
    frozen = np.frombuffer(np.repeat(belief, 2).tobytes())[::2]

    assert_array_equal(
        answered(models, 0, frozen, LIKE).belief,
        answered(models, 0, belief, LIKE).belief,
    )
