"""Groups that are alike, against a dictionary."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn
from numpy.testing import assert_array_equal

from policies.groups import Groups, distinct


@st.composite
def repeated(draw: DrawFn) -> Groups:
    """Groups of few models and beliefs, so that many are alike."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    states, total = draw(st.integers(2, 5)), draw(st.integers(0, 60))
    beliefs = rng.dirichlet(np.ones(states), draw(st.integers(1, 40)))
    return Groups(
        rng.integers(0, draw(st.integers(1, 4)), total),
        beliefs[rng.integers(0, len(beliefs), total)].reshape(total, states),
        rng.integers(1, 5, total),
        rng.integers(0, draw(st.integers(1, 3)), total),
    )


@settings(deadline=None, max_examples=200)
@given(repeated(), st.booleans())
def test_groups_that_are_alike_are_one(groups: Groups, by_rest: bool) -> None:  # noqa: FBT001 - drawn
    keys = [
        (model, belief.tobytes(), rested if by_rest else 0)
        for model, belief, rested in zip(
            groups.model, groups.belief, groups.rested, strict=True
        )
    ]
    order = list(dict.fromkeys(keys))

    alike, row = distinct(groups, by_rest)

    first = [keys.index(key) for key in order]
    assert row.tolist() == [order.index(key) for key in keys]
    assert_array_equal(alike.model, groups.model[first])
    assert_array_equal(alike.belief, groups.belief[first])
    assert_array_equal(alike.rested, groups.rested[first])
    sizes = [groups.size[row == place].sum() for place in range(len(order))]
    assert alike.size.tolist() == sizes


def test_a_thousand_groups_are_told_apart() -> None:
    """Beliefs that differ in the last bit of one state."""
    belief = np.full((1000, 4), 0.25)
    belief[:, 1] += np.arange(1000) * np.spacing(0.25)
    ones = np.ones(1000, dtype=np.int64)
    groups = Groups(0 * ones, belief, ones, 0 * ones)

    alike, row = distinct(groups, False)  # noqa: FBT003 - compiled

    assert len(alike.model) == 1000
    assert_array_equal(row, np.arange(1000))
