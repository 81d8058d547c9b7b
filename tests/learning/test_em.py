"""Learning rises, ends at a top, and finds what made the log."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from learning import Plays
from learning.chain import Chain
from learning.em import Climb, Effort, Terms, beginnings, learn, stretched
from learning.expectation import chances, expect
from learning.maximization import Smoothing, log_prior, maximize
from learning.streams import Streams, streams
from policies import Floats, Ints
from tests.learning.logs import chain, logs, moods, sampled

SEEDS = st.integers(0, 2**32)
REWARD = np.array([0.0, 1.0])


def height(seen: Streams, true: Chain, smoothing: Smoothing) -> float:
    return expect(seen, true).likelihood + log_prior(true, smoothing)


@settings(deadline=None, max_examples=60)
@given(
    plays=logs(most=30),
    seed=SEEDS,
    classes=st.integers(1, 2),
    states=st.integers(2, 4),
    in_time=st.booleans(),
)
def test_each_step_rises(
    plays: Plays, seed: int, classes: int, states: int, *, in_time: bool
) -> None:
    seen = streams(plays, moods(plays, classes, seed), in_time=in_time)
    found, smoothing = chain(seed, states, classes, in_time=in_time), Smoothing()

    for _ in range(6):
        before = height(seen, found, smoothing)
        found = maximize(expect(seen, found), found, smoothing)
        assert height(seen, found, smoothing) >= before - 1e-9 * abs(before)
        assert_stochastic(found)


def assert_stochastic(found: Chain) -> None:
    assert_allclose(found.play.sum(axis=1), 1.0)
    assert_allclose(found.rest.sum(axis=1), 0.0 if found.in_time else 1.0, atol=1e-12)
    assert_allclose(found.observe.sum(axis=2), 1.0)
    assert found.prior.sum() == pytest.approx(1.0)
    off = ~np.eye(len(found.rest), dtype=np.bool_)
    assert (found.rest[off] > 0).all()
    assert (found.play > 0).all()


@settings(deadline=None, max_examples=25)
@given(plays=logs(most=40, users=5), seed=SEEDS, in_time=st.booleans())
def test_a_stretched_climb_never_goes_down(
    plays: Plays, seed: int, *, in_time: bool
) -> None:
    seen = streams(plays, in_time=in_time)
    begun = chain(seed, in_time=in_time)
    climb = Climb(seen.parts(3), begun, Terms(Smoothing()), map)

    climb.on(30, 0.0)

    assert (np.diff(climb.risen) >= -1e-9 * np.abs(climb.risen[0])).all()
    assert climb.height == pytest.approx(height(seen, climb.chain, Smoothing()))
    assert_stochastic(climb.chain)


def test_steps_that_shrink_steadily_are_summed_at_once() -> None:
    """As a geometric series: the limit is met in one stretch."""
    ends = np.log(np.array([[0.7, 0.3], [0.2, 0.8]]))
    way = np.array([[0.4, -0.4], [0.3, -0.3]])

    def at(share: float) -> Chain:
        play = np.exp(ends + share * way)
        ones = np.full((2, 2), 0.5)
        return Chain(play, ones, ones[None], ones[0])

    found = stretched(at(1.0), at(0.9), at(0.81))

    assert_allclose(found.play, np.exp(ends), rtol=1e-9)


@pytest.fixture(scope="module")
def world() -> tuple[Plays, Chain]:
    """200 users of 100 plays of 4 arms, and what they follow."""
    true = Chain(
        np.array([[0.8, 0.2], [0.35, 0.65]]),
        np.array([[0.7, 0.3], [0.05, 0.95]]),
        np.array([[[0.9, 0.1], [0.15, 0.85]]]),
        np.array([0.5, 0.5]),
    )
    return sampled([true], np.random.default_rng(3), 200, 100, 4), true


def log_loss(chance: Floats, answer: Ints) -> float:
    return -float(np.log(np.where(answer == 1, chance, 1 - chance)).mean())


def test_what_made_a_log_is_found(world: tuple[Plays, Chain]) -> None:
    plays, true = world
    seen, effort = streams(plays), Effort(starts=3, steps=300)

    found = learn(seen, beginnings(2, 0.5, effort), REWARD, effort, Terms(Smoothing()))

    assert found.settled
    assert found.chain.observe[0, 0, 1] < found.chain.observe[0, 1, 1]
    assert found.counts.likelihood > expect(seen, true).likelihood
    assert_allclose(found.chain.observe, true.observe, atol=0.08)
    assert_allclose(found.chain.play, true.play, atol=0.1)
    assert_allclose(found.chain.rest, true.rest, atol=0.1)
    losses = [
        log_loss(chances(seen, each)[:, 1], seen.answer) for each in (found.chain, true)
    ]
    assert losses[0] < 1.002 * losses[1]


def test_threads_change_nothing_and_seeds_say_where_to_begin(
    world: tuple[Plays, Chain],
) -> None:
    seen = streams(world[0])
    effort = Effort(starts=2, steps=10, seed=5)
    learned = partial(learn, seen, beginnings(2, 0.5, effort), REWARD, effort)

    alone = learned(Terms(Smoothing()))
    with ThreadPoolExecutor(2) as pool:
        beside = learned(Terms(Smoothing()), pool.map)

    assert alone.risen == beside.risen
    assert (alone.chain.play == beside.chain.play).all()
    assert len(alone.others) == 1
    other, again = (beginnings(2, 0.5, Effort(seed=seed))[0] for seed in (6, 5))
    assert not np.allclose(other.play, again.play)
    assert np.allclose(beginnings(2, 0.5, effort)[0].play, again.play)
    assert not alone.settled


@pytest.mark.parametrize("in_time", [False, True])
def test_beginnings_are_near_the_identity(*, in_time: bool) -> None:
    effort = Effort(starts=20)

    drawn = beginnings(4, 0.3, effort, moods=3, signals=3, in_time=in_time)

    assert len(drawn) == 20
    for begun in drawn:
        assert_stochastic(begun)
        assert begun.observe.shape == (3, 4, 3)
        assert (np.diagonal(begun.play) > 0.9).all()
        assert (begun.observe[0] @ [0, 0.5, 1]).argsort().tolist() == [0, 1, 2, 3]
