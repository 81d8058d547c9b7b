import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from policies import ModelSet
from tests.policies.instances import arrays_of, random_models, telling_model


def test_smaller_models_are_padded_with_states_nobody_is_in() -> None:
    models = random_models(1, [2, 4])

    stacked = ModelSet.of(models)

    assert_array_equal(stacked.states, [2, 4])
    assert_array_equal(stacked.play[0, :2, :2], models[0].play)
    assert_array_equal(stacked.rest[0, 2:, 2:], np.eye(2))
    assert_array_equal(stacked.play[0, 2:, :2], 0)
    assert_array_equal(stacked.play[0, :2, 2:], 0)
    assert_array_equal(stacked.like[0, 2:], 0)
    assert_array_equal(stacked.prior[0, 2:], 0)
    assert_array_equal(stacked.prior[1], models[1].prior)


def test_fewer_signals_are_padded_with_signals_never_given() -> None:
    rng = np.random.default_rng(5)
    models = [telling_model(rng, 2, 3), telling_model(rng, 4, 5)]

    stacked = ModelSet.of(models)

    assert_array_equal(stacked.signals, [3, 5])
    assert_array_equal(stacked.observe[0, :3, :2], models[0].observe.T)
    assert_array_equal(stacked.observe[0, 3:], 0)
    assert_array_equal(stacked.reward[0], [*models[0].reward, 0, 0])
    assert_array_equal(stacked.observe[1], models[1].observe.T)


def test_powers_are_powers_and_stay_stochastic() -> None:
    models = random_models(2, [3, 3])

    powers = ModelSet.of(models).rest_powers

    assert_array_equal(powers[1, 0], models[1].rest)
    for j in range(6):
        expected = np.linalg.matrix_power(models[1].rest, 2**j)
        assert_allclose(powers[1, j], expected, atol=1e-14)
    assert powers.shape == (2, 41, 3, 3)
    assert_allclose(powers.sum(axis=-1), 1, atol=1e-14)


def test_padding_changes_no_bit_of_the_powers() -> None:
    small, large = random_models(3, [3, 5])

    alone = ModelSet.of([small]).rest_powers[0]
    padded = ModelSet.of([small, large]).rest_powers[0]

    assert_array_equal(padded[:, :3, :3], alone)


def test_all_arrays_are_plain() -> None:
    for array in arrays_of(ModelSet.of(random_models(4, [2, 3]))).values():
        assert array.flags.carray
        assert array.dtype in (np.float64, np.int64)


def test_a_set_may_be_empty() -> None:
    assert ModelSet.of([]).play.shape == (0, 0, 0)
