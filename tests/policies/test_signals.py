"""Models of any number of signals: from none that tells to one that tells all."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    MOST_SURPRISE,
    NONE,
    Floats,
    Model,
    ModelSet,
    Signals,
    answered,
    expected_like,
    replayed,
    rested,
)
from tests.policies.instances import random_model, telling_model
from tests.policies.oracles import Slot, enumerated_belief

SEEDS = st.integers(0, 2**32)
SIZES = st.integers(2, 5)
COUNTS = st.integers(1, 6)


def with_signals(plain: Model, signals: Signals) -> Model:
    return Model(
        plain.states, plain.play, plain.rest, None, plain.prior, signals=signals
    )


def drawn(seed: int, size: int, signals: int) -> tuple[Model, ModelSet, Floats]:
    rng = np.random.default_rng(seed)
    model = telling_model(rng, size, signals)
    return model, ModelSet.of([model]), rng.dirichlet(np.ones(size))


@st.composite
def logs(draw: st.DrawFn, signals: int) -> list[Slot]:
    told = st.integers(NONE, signals - 1)
    slot = st.builds(Slot, st.booleans(), told)
    return draw(st.lists(slot, max_size=5))


@settings(deadline=None, max_examples=60)
@given(st.data(), SEEDS, st.integers(2, 3), st.integers(1, 4))
def test_the_filter_is_the_sum_over_hidden_paths(
    data: st.DataObject, seed: int, size: int, signals: int
) -> None:
    model, models, _ = drawn(seed, size, signals)
    slots = data.draw(logs(signals))
    plays = [t for t, slot in enumerate(slots) if slot.played]

    slot, belief = replayed(
        models,
        0,
        np.array(plays, dtype=np.int64),
        np.array([slots[t].signal for t in plays], dtype=np.int64),
    )

    after = rested(models, np.array([0]), belief[None], np.array([len(slots) - slot]))
    assert_allclose(after[0], enumerated_belief(model, slots), atol=1e-12)


@settings(deadline=None)
@given(SEEDS, SIZES, COUNTS)
def test_an_answer_moves_no_belief_and_no_reward_on_average(
    seed: int, size: int, signals: int
) -> None:
    model, models, belief = drawn(seed, size, signals)
    chances = belief @ model.observe

    told = [answered(models, 0, belief, k) for k in range(signals)]

    mean = sum(p * each.belief for p, each in zip(chances, told, strict=True))
    assert_allclose(mean, belief @ model.play, atol=1e-14)
    assert_allclose([each.surprise for each in told], -np.log(chances), atol=1e-12)
    like = expected_like(models, np.array([0]), belief[None])
    assert_allclose(like, chances @ model.reward, atol=1e-14)


@settings(deadline=None)
@given(SEEDS, SIZES)
def test_the_only_signal_there_is_tells_nothing(seed: int, size: int) -> None:
    _, models, belief = drawn(seed, size, 1)

    after = answered(models, 0, belief, 0)

    assert_array_equal(after.belief, answered(models, 0, belief, NONE).belief)
    assert after.surprise == pytest.approx(0, abs=1e-15)
    assert not after.impossible


@settings(deadline=None)
@given(st.data(), SEEDS, SIZES)
def test_a_signal_of_its_own_for_each_state_tells_all(
    data: st.DataObject, seed: int, size: int
) -> None:
    plain, _, belief = drawn(seed, size, 2)
    names = [f"y{k}" for k in range(size)]
    model = with_signals(plain, Signals(names, np.eye(size), np.arange(size) / size))
    models = ModelSet.of([model])
    state = data.draw(st.integers(0, size - 1))

    after = answered(models, 0, belief, state)

    assert_allclose(after.belief, model.play[state], atol=1e-15)
    assert after.surprise == pytest.approx(-math.log(belief[state]))
    ruled_out = np.eye(size)[(state + 1) % size]
    impossible = answered(models, 0, ruled_out, state)
    assert (impossible.impossible, impossible.surprise) == (True, MOST_SURPRISE)
    assert_allclose(impossible.belief, ruled_out @ model.play)


@settings(deadline=None)
@given(SEEDS, SIZES)
def test_a_skip_and_a_like_by_name_are_those_of_a_like(seed: int, size: int) -> None:
    plain = random_model(np.random.default_rng(seed), size)
    named = with_signals(plain, Signals(("skip", "like"), plain.observe, (0, 1)))
    models = ModelSet.of([plain, named])

    assert_allclose(named.like, plain.like, atol=1e-15)
    for signal in (0, 1, NONE):
        first, second = (answered(models, m, plain.prior, signal) for m in (0, 1))
        assert_allclose(first.belief, second.belief, atol=1e-15)


@settings(deadline=None)
@given(SEEDS, SIZES, COUNTS)
def test_the_order_of_signals_means_nothing(seed: int, size: int, signals: int) -> None:
    model, _, belief = drawn(seed, size, signals)
    order = np.random.default_rng(seed).permutation(signals)
    names = [model.signals[k] for k in order]
    mixed = with_signals(
        model, Signals(names, model.observe[:, order], model.reward[order])
    )
    models = ModelSet.of([model, mixed])

    assert_allclose(mixed.like, model.like, atol=1e-15)
    for place, signal in enumerate(order):
        assert_allclose(
            answered(models, 1, belief, place).belief,
            answered(models, 0, belief, int(signal)).belief,
            atol=1e-15,
        )


@settings(deadline=None)
@given(st.data(), SEEDS, COUNTS, st.integers(0, 100))
def test_padding_with_states_and_signals_changes_no_bit(
    data: st.DataObject, seed: int, signals: int, slots: int
) -> None:
    small, alone, belief = drawn(seed, 2, signals)
    large = telling_model(np.random.default_rng(seed), 5, 7)
    both = ModelSet.of([large, small])
    signal = data.draw(st.integers(NONE, signals - 1))
    wide = np.pad(belief, (0, 3))

    def followed(models: ModelSet, m: int, start: Floats) -> tuple[Floats, float]:
        rested_for = np.array([slots])
        before = rested(models, np.array([m]), start[None], rested_for)[0]
        after = answered(models, m, before, signal)
        return after.belief, after.surprise

    expected, surprise = followed(alone, 0, belief)
    padded, same = followed(both, 1, wide)
    assert_array_equal(padded, np.pad(expected, (0, 3)))
    assert same == surprise
