"""Where an advantage changes sign, on functions whose zero is known."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies.ladder import sign_changes

LADDER = np.linspace(-1, 1, 21)
SLOPES = st.floats(-20, -0.1)


@settings(deadline=None, max_examples=300)
@given(st.floats(-0.85, 0.85), st.floats(-1, 1), SLOPES, SLOPES)
def test_a_zero_is_found_wherever_a_line_bends_once(
    zero: float, bend: float, before: float, after: float
) -> None:
    def bent(at: float) -> float:
        return (before if at < bend else after) * (at - bend)

    advantage = np.array([[bent(rung) - bent(zero)] for rung in LADDER])

    found, _, again = sign_changes(LADDER, advantage)

    assert_allclose(found, zero, atol=1e-9)
    assert not again.any()


def test_two_bends_between_rungs_leave_a_doubt_that_holds_the_zero() -> None:
    """It falls slowly, fast from its zero on, and soon as slowly again."""
    zero, soon = 0.02, 0.05
    fast = np.clip(LADDER, zero, soon) - zero
    advantage = (zero - LADDER - 30 * fast)[:, None]

    found, doubt, _ = sign_changes(LADDER, advantage)

    assert abs(found[0] - zero) > 0.01
    assert doubt[0] >= abs(found[0] - zero)


def test_a_straight_line_leaves_no_doubt() -> None:
    _, doubt, _ = sign_changes(LADDER, (0.33 - LADDER)[:, None])

    assert_allclose(doubt, 0, atol=1e-12)


def test_without_a_change_it_is_an_end_of_the_ladder() -> None:
    always, never = np.ones_like(LADDER), -np.ones_like(LADDER)

    found, doubt, again = sign_changes(LADDER, np.stack((always, never), axis=1))

    assert_array_equal(found, [1.0, -1.0])
    assert_array_equal(doubt, [0.0, 0.0])
    assert not again.any()


def test_playing_that_becomes_best_again_is_seen() -> None:
    falling = -LADDER
    returning = np.where(LADDER > 0.55, 0.5, falling)
    barely = np.where(LADDER > 0.55, 1e-7, falling)

    found, _, again = sign_changes(
        LADDER, np.stack((falling, returning, barely), axis=1)
    )

    assert_allclose(found, [0, 0, 0], atol=1e-12)
    assert_array_equal(again, [False, True, False])
