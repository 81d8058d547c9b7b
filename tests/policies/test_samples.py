"""Models that are not known for sure: one chain over pairs of a sample and a state."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    LIKE,
    NONE,
    SKIP,
    Floats,
    InvalidModel,
    Model,
    ModelSet,
    Signals,
    answered,
    create,
    expected_like,
    ready,
    rested,
    untouched,
)
from policies.samples import conditioned
from tests.policies.instances import (
    arrays_of,
    random_models,
    situation,
    uncertain,
)

SLOTS = st.lists(st.sampled_from([LIKE, SKIP, NONE, None]), max_size=8)


def followed(
    models: ModelSet, m: int, slots: Sequence[int | None]
) -> tuple[Floats, float]:
    """Return the belief after some slots (None: rest) and the chance of the answers."""
    belief, chance = models.prior[m], 1.0
    row, one = np.array([m]), np.array([1])
    for signal in slots:
        if signal is None:
            belief = rested(models, row, belief[None], one)[0]
        else:
            after = answered(models, m, belief, signal)
            belief, chance = after.belief, chance * math.exp(-after.surprise)
    return belief, chance


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32), st.integers(1, 4), SLOTS)
def test_a_belief_is_the_posterior_over_samples_and_states(
    seed: int, samples: int, slots: list[int | None]
) -> None:
    model = uncertain(seed, samples)
    alone = [followed(ModelSet.of([s]), 0, slots) for s in model.samples]
    weights = np.concatenate([chance * belief for belief, chance in alone])

    belief, chance = followed(ModelSet.of([model]), 0, slots)

    assert_allclose(belief, weights / weights.sum(), atol=1e-12)
    assert chance == pytest.approx(np.mean([chance for _, chance in alone]))


def test_at_first_all_samples_are_alike() -> None:
    model, certain = uncertain(1, 3), random_models(2, [4])[0]
    models = ModelSet.of([certain, model])

    priors = [sample.prior / 3 for sample in model.samples]
    assert_array_equal(models.prior[1], np.concatenate(priors))
    likes = [float(sample.prior @ sample.like) for sample in model.samples]
    now = expected_like(models, np.arange(2), untouched(models, 0))
    assert_allclose(now, [float(certain.prior @ certain.like), sum(likes) / 3])
    assert models.states.tolist() == [4, 9]
    assert models.samples.tolist() == [1, 3]
    assert ModelSet.of([certain]).separated().samples.tolist() == [1]


def test_samples_may_have_any_signals() -> None:
    rng = np.random.default_rng(1)
    names, reward = ("skip", "part", "all"), [0.0, 0.3, 1.0]
    draws = [
        Model(
            ("a", "b"),
            rng.dirichlet(np.ones(2), 2),
            rng.dirichlet(np.ones(2), 2),
            None,
            rng.dirichlet(np.ones(2)),
            Signals(names, rng.dirichlet(np.ones(3), 2), reward),
        )
        for _ in range(2)
    ]
    first = draws[0]
    signals = Signals(first.signals, first.observe, first.reward)
    parts = (first.states, first.play, first.rest, None, first.prior, signals)
    model = Model(*parts, samples=draws)

    alone = [followed(ModelSet.of([draw]), 0, [2, None, 1, 0]) for draw in draws]
    belief, _ = followed(ModelSet.of([model]), 0, [2, None, 1, 0])

    weights = np.concatenate([chance * belief for belief, chance in alone])
    assert_allclose(belief, weights / weights.sum(), atol=1e-12)


def test_separated_samples_are_models_of_their_own() -> None:
    certain, first, second = *random_models(3, [2]), uncertain(4, 2), uncertain(5, 3, 4)
    models = ModelSet.of([certain, first, second])
    apart = [certain, *first.samples, *second.samples]

    expected = arrays_of(ModelSet.of(apart))
    for name, got in arrays_of(models.separated()).items():
        assert_allclose(got, expected[name], rtol=0, atol=1e-15, err_msg=name)
        assert got.flags.carray
    sure = ModelSet.of([certain])
    assert sure.separated() is sure


def test_a_draw_takes_the_same_sample_of_every_model() -> None:
    certain, first, second = *random_models(3, [2]), uncertain(4, 2), uncertain(5, 3)
    models = ModelSet.of([certain, first, second])

    third = arrays_of(ModelSet.of([certain, first.samples[0], second.samples[2]]))

    for name, got in arrays_of(models.drawn(2)).items():
        assert_allclose(got, third[name], rtol=0, atol=1e-15)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32), SLOTS)
def test_the_belief_in_a_sample_is_that_of_the_sample_alone(
    seed: int, slots: list[int | None]
) -> None:
    certain, first, second = *random_models(seed, [4]), uncertain(1, 2), uncertain(2, 3)
    models = ModelSet.of([certain, first, second])
    rows = np.array([2, 0, 1])
    belief = np.stack([followed(models, m, slots)[0] for m in rows])

    given_draws = conditioned(models, rows, belief, 3, 4)

    for k in range(3):
        drawn = models.drawn(k)
        alone = np.stack([followed(drawn, m, slots)[0] for m in rows])
        assert_allclose(given_draws[k], alone, atol=1e-9)
        assert_array_equal(given_draws[k, 1], belief[1, :4])


def test_a_sample_that_is_ruled_out_believes_what_the_others_do() -> None:
    even, step = [[0.5, 0.5], [0.5, 0.5]], [[0.9, 0.1], [0.3, 0.7]]
    never, rare, often = (
        Model(("low", "high"), step, step, like, [0.2, 0.8])
        for like in ([0, 0], [0.1, 0.4], [0.5, 0.9])
    )
    model = Model(
        ("low", "high"), even, even, [0, 1], [0, 1], samples=[never, rare, often]
    )
    models = ModelSet.of([model])
    belief, _ = followed(models, 0, [LIKE])

    given_draws = conditioned(models, np.array([0]), belief[None], 3, 2)[:, 0]

    assert_array_equal(belief[:2], 0)
    assert_allclose(given_draws[0], belief[2:4] + belief[4:])
    assert_allclose(given_draws.sum(axis=1), 1)


@pytest.mark.parametrize("name", ["myopic", "best_fixed", "rollout", "whittle_mc"])
def test_policies_plan_on_samples_as_on_any_chain(name: str) -> None:
    model = uncertain(7, 2)
    first, second = model.samples
    gone = np.zeros((3, 3))
    chain = Model(
        [f"{sample} {state}" for sample in range(2) for state in model.states],
        np.block([[first.play, gone], [gone, second.play]]),
        np.block([[first.rest, gone], [gone, second.rest]]),
        [*first.like, *second.like],
        [*first.prior / 2, *second.prior / 2],
    )
    belief = np.random.default_rng(8).dirichlet(np.ones(6), 2)

    got, expected = (
        ready(create(name, {}), models)(situation(models, [0, 0], belief, [1, 2]), 3)
        for models in (ModelSet.of([model]), ModelSet.of([chain]))
    )

    assert_allclose(got, expected, atol=1e-12)


def test_what_is_wrong_with_a_sample_is_named() -> None:
    model, small, other = random_models(9, [3, 2, 3])
    names = Signals(("no", "yes"), other.observe, other.reward)
    worth = Signals(other.signals, other.observe, [0.0, 0.5])
    parts = other.states, other.play, other.rest, None, other.prior

    for wrong, message in (
        (small, "other states or signals"),
        (Model(*parts, names), "other states or signals"),
        (Model(*parts, worth), "other rewards"),
        (uncertain(1, 2), "samples itself"),
    ):
        with pytest.raises(InvalidModel, match=message) as caught:
            Model(
                model.states,
                model.play,
                model.rest,
                model.like,
                model.prior,
                samples=[other, wrong],
            )
        assert caught.value.field == "samples[1]"
