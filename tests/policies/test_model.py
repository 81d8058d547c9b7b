import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from policies import InvalidModel, Model, Signals
from tests.policies.instances import paper

STATES = ("low", "high")
EVEN = [[0.5, 0.5], [0.5, 0.5]]


def make(**changes: object) -> Model:
    parts: dict[str, object] = {
        "states": STATES,
        "play": EVEN,
        "rest": [[0.9, 0.1], [0.2, 0.8]],
        "like": [0.1, 0.9],
        "prior": [0.3, 0.7],
    }
    build = Model
    return build(**(parts | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("states", {"states": ["one"]}),
        ("states", {"states": "ab"}),
        ("states[1]", {"states": ["low", "low"]}),
        ("states[0]", {"states": [" ", "high"]}),
        ("play", {"play": [[1.0]]}),
        ("play", {"play": [[1.0, 0.0], [1.0]]}),
        ("play", {"play": "no"}),
        ("play", {"play": [[1j, 0], [0, 1]]}),
        ("play", {"play": [[np.nan, 1], [0, 1]]}),
        ("play[1]", {"play": [[1, 0], [0.5, 0.500002]]}),
        ("play[0]", {"play": [[1.1, -0.1], [0, 1]]}),
        ("rest", {"rest": np.eye(3)}),
        ("rest[1]", {"rest": [[1, 0], [0, 0.999998]]}),
        ("like", {"like": [0.5]}),
        ("like", {"like": [0.5, np.inf]}),
        ("like[1]", {"like": [0.5, 1.0000001]}),
        ("like[0]", {"like": [-1e-12, 1]}),
        ("prior", {"prior": [0.5, 0.6]}),
        ("prior", {"prior": [-0.5, 1.5]}),
        ("prior", {"prior": [None, 1]}),
    ],
)
def test_a_wrong_part_is_named(field: str, changes: dict[str, object]) -> None:
    with pytest.raises(InvalidModel) as caught:
        make(**changes)

    assert caught.value.field == field
    assert str(caught.value).startswith(f"{field}: ")


def told(**changes: object) -> Signals:
    parts = {
        "names": ("skip", "partial", "complete"),
        "observe": [[0.7, 0.2, 0.1], [0.1, 0.3, 0.6]],
        "reward": [0, 0.4, 1],
    }
    build = Signals
    return build(**(parts | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("field", "signals"),
    [
        ("signals", told(names=())),
        ("signals", told(names="abc")),
        ("signals[2]", told(names=("skip", "partial", "skip"))),
        ("signals[1]", told(names=("skip", "", "complete"))),
        ("signals[1]", told(names=("skip", "none", "complete"))),
        ("observe", told(observe=[[0.7, 0.3], [0.4, 0.6]])),
        ("observe", told(observe=[[0.7, 0.2, 0.1]])),
        ("observe[1]", told(observe=[[0.7, 0.2, 0.1], [0.1, 0.3, 0.7]])),
        ("observe[0]", told(observe=[[1.2, -0.3, 0.1], [0.1, 0.3, 0.6]])),
        ("reward", told(reward=[0, 1])),
        ("reward[1]", told(reward=[0, 1.1, 1])),
        ("reward[0]", told(reward=[-0.1, 0, 1])),
    ],
)
def test_a_wrong_part_of_the_signals_is_named(field: str, signals: Signals) -> None:
    with pytest.raises(InvalidModel) as caught:
        make(like=None, signals=signals)

    assert caught.value.field == field


@pytest.mark.parametrize("changes", [{"like": None}, {"signals": told()}])
def test_either_likes_or_signals_are_given(changes: dict[str, object]) -> None:
    with pytest.raises(InvalidModel) as caught:
        make(**changes)

    assert caught.value.field == "like"


def test_signals_imply_what_a_play_is_worth() -> None:
    model = make(like=None, signals=told())

    assert model.signals == ("skip", "partial", "complete")
    assert_allclose(model.like, [0.2 * 0.4 + 0.1, 0.3 * 0.4 + 0.6], atol=1e-15)


def test_likes_are_signals_too() -> None:
    model = make()

    assert model.signals == ("skip", "like")
    assert_array_equal(model.observe, [[1 - 0.1, 0.1], [1 - 0.9, 0.9]])
    assert_array_equal(model.reward, [0, 1])


def test_rows_within_the_tolerance_are_normalised() -> None:
    model = make(play=[[0.3333333, 0.6666666], [1, 0]], prior=[0.2, 0.8000005])

    assert_allclose(model.play.sum(axis=1), 1, rtol=0, atol=3e-16)
    assert_allclose(model.prior.sum(), 1, rtol=0, atol=3e-16)
    assert_allclose(model.play[0], [1 / 3, 2 / 3], atol=1e-7)


def test_arrays_are_own_copies() -> None:
    like = np.array([0.1, 0.9])
    model = make(like=like)

    like[0] = 0.7

    assert_array_equal(model.like, [0.1, 0.9])


def test_a_falling_like_is_accepted_with_a_warning() -> None:
    model = make(like=[0.9, 0.1])

    (warning,) = model.warnings
    assert "'low' (0.9)" in warning
    assert "'high' (0.1)" in warning


@pytest.mark.parametrize("example", [1, 2, 3])
def test_the_examples_of_the_paper_are_models(example: int) -> None:
    assert [model.warnings for model in paper(example)] == [()] * 5
