"""The grid of beliefs, against the list of its points and Lovejoy's description."""

from itertools import product

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn
from numpy.testing import assert_allclose

from policies import Floats, Ints, as_floats, grid


@st.composite
def beliefs(draw: DrawFn, states: int) -> Floats:
    """Beliefs inside, on edges, and on the points of some grid or other."""
    if draw(st.booleans()):
        rng = np.random.default_rng(draw(st.integers(0, 2**32)))
        belief = rng.dirichlet(np.full(states, draw(st.sampled_from([0.05, 1.0]))))
        return as_floats(belief / belief.sum())
    parts = st.lists(st.integers(0, 4), min_size=states, max_size=states)
    weights = np.array(draw(parts.filter(any)), dtype=np.float64)
    return as_floats(weights / weights.sum())


@st.composite
def located(draw: DrawFn) -> tuple[int, int, Floats]:
    states = draw(st.integers(2, 6))
    return states, draw(st.integers(1, 8)), draw(beliefs(states))


def corners_of(states: int, divisions: int, belief: Floats) -> tuple[Ints, Floats]:
    """Return ranks and weights of all corners around a belief."""
    room = grid.corners(states)
    steps = grid.steps(states, divisions)
    grid.find(steps, states, divisions, belief[None].copy(), 0, room)
    return room["rank"].copy(), room["weight"].copy()


def interpolated(states: int, divisions: int, belief: Floats, values: Floats) -> float:
    ranks, weights = corners_of(states, divisions, belief)
    return float(weights @ values[ranks])


def test_the_points_are_all_beliefs_of_whole_parts() -> None:
    for states, divisions in product(range(2, 7), range(1, 6)):
        points = np.rint(grid.beliefs(states, divisions) * divisions).astype(int)

        parts = product(range(divisions + 1), repeat=states)
        expected = [part for part in parts if sum(part) == divisions]
        assert sorted(map(tuple, points.tolist())) == expected
        assert len(points) == grid.size(states, divisions)
        assert_allclose(grid.beliefs(states, divisions), points / divisions)


def test_a_point_is_its_own_corner() -> None:
    for states, divisions in product(range(2, 7), range(1, 6)):
        for rank, belief in enumerate(grid.beliefs(states, divisions)):
            ranks, weights = corners_of(states, divisions, belief)
            shares = np.zeros(grid.size(states, divisions))
            np.add.at(shares, ranks, weights)
            assert_allclose(shares, np.eye(len(shares))[rank], atol=1e-12)


@settings(deadline=None, max_examples=300)
@given(located())
def test_weights_are_a_distribution_over_points_whose_mean_is_the_belief(
    case: tuple[int, int, Floats],
) -> None:
    states, divisions, belief = case

    ranks, weights = corners_of(*case)

    assert (weights >= -1e-12).all()
    assert_allclose(weights.sum(), 1, atol=1e-12)
    points = grid.beliefs(states, divisions)
    assert ((ranks >= 0) & (ranks < len(points))).all()
    assert_allclose(weights @ points[ranks], belief, atol=1e-12)


@settings(deadline=None, max_examples=300)
@given(located())
def test_the_corners_are_those_of_freudenthals_triangulation(
    case: tuple[int, int, Floats],
) -> None:
    """From the whole parts of the tails, a step for each fraction, largest first."""
    states, divisions, belief = case
    points = grid.beliefs(states, divisions)

    ranks, weights = corners_of(*case)

    tails = np.minimum(np.cumsum(belief[::-1])[::-1][1:], 1) * divisions
    corner = np.floor(tails)
    fractions = tails - corner
    expected = np.zeros(states)
    before = 1.0
    for i in [*np.argsort(-fractions, kind="stable"), None]:
        weight = before - (0.0 if i is None else fractions[i])
        whole = np.concatenate(([divisions], corner, [0]))
        expected += weight * (whole[:-1] - whole[1:]) ** 2
        if i is not None:
            before, corner = fractions[i], corner + np.eye(states - 1)[i]
    squares = (points * divisions) ** 2
    assert_allclose(weights @ squares[ranks], expected, atol=1e-9)


@settings(deadline=None, max_examples=100)
@given(located(), st.integers(0, 2**32))
def test_a_linear_function_is_interpolated_exactly(
    case: tuple[int, int, Floats], seed: int
) -> None:
    states, divisions, belief = case
    worth = np.random.default_rng(seed).normal(size=states)

    values = grid.beliefs(states, divisions) @ worth

    assert_allclose(interpolated(*case, values), belief @ worth, atol=1e-12)


@settings(deadline=None, max_examples=200)
@given(located(), st.integers(2, 3), st.integers(0, 2**32))
def test_a_convex_function_is_never_exceeded_and_more_closely_on_a_finer_grid(
    case: tuple[int, int, Floats], finer: int, seed: int
) -> None:
    states, divisions, belief = case
    planes = np.random.default_rng(seed).normal(size=(5, states))

    def convex(points: Floats) -> Floats:
        return as_floats((points @ planes.T).max(axis=-1))

    coarse, fine = (
        interpolated(states, m, belief, convex(grid.beliefs(states, m)))
        for m in (divisions, finer * divisions)
    )

    assert coarse >= fine - 1e-12
    assert fine >= convex(belief) - 1e-12


def test_steps_serve_smaller_grids_of_fewer_states() -> None:
    belief = np.array([[0.1, 0.25, 0.65]])
    small, large = grid.corners(3), grid.corners(6)

    grid.find(grid.steps(3, 7), 3, 7, belief, 0, small)
    grid.find(grid.steps(6, 20), 3, 7, belief, 0, large)

    assert small["rank"].tolist() == large["rank"][:3].tolist()
    assert small["weight"].tolist() == large["weight"][:3].tolist()


def test_a_sum_that_rounding_makes_exceed_one_is_located() -> None:
    for states in range(2, 7):
        belief = np.zeros(states)
        belief[-1] = 1 + 1e-15

        ranks, weights = corners_of(states, 5, belief)

        assert ranks.max() < grid.size(states, 5)
        assert_allclose(weights @ grid.beliefs(states, 5)[ranks], belief, atol=1e-12)
