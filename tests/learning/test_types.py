"""Which arm is of which type; what a log tells; how sure it is."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from learning import Plays
from learning.chain import Chain
from learning.em import Effort, Learned, Terms, beginnings, learn
from learning.expectation import likelihoods
from learning.identification import identify, singular_values
from learning.maximization import Bond, Smoothing
from learning.mixture import learn_types
from learning.resampling import intervals
from learning.streams import Streams, streams
from tests.learning.logs import log, sampled

REWARD = np.array([0.0, 1.0])
STILL = np.array([[0.98, 0.02], [0.02, 0.98]])
TIRING = Chain(  # a play tires, a rest restores
    np.array([[0.95, 0.05], [0.7, 0.3]]),
    np.array([[0.6, 0.4], [0.05, 0.95]]),
    np.array([[[0.95, 0.05], [0.1, 0.9]]]),
    np.array([0.2, 0.8]),
)
STEADY = Chain(STILL, STILL, np.array([[[0.9, 0.1], [0.2, 0.8]]]), np.array([0.5, 0.5]))
EFFORT = Effort(starts=3, steps=120)


def learned(seen: Streams, effort: Effort = EFFORT) -> Learned:
    begun = beginnings(2, 0.5, effort)
    return learn(seen, begun, REWARD, effort, Terms(Smoothing()))


@pytest.fixture(scope="module")
def mixed() -> Plays:
    """Arms 0, 2, 4, ... tire, the others are steady."""
    return sampled([TIRING, STEADY], np.random.default_rng(1), 120, 120, 12)


def test_arms_find_their_types_and_types_their_chains(mixed: Plays) -> None:
    seen = streams(mixed)
    whole = learned(seen)

    enough = Effort(steps=400, tolerance=1e-6)
    found = learn_types(seen, whole.chain, 13, 2, enough, Smoothing())

    kind = found.of_arms[:12]
    assert len(set(kind[::2])) == len(set(kind[1::2])) == 1
    assert kind[0] != kind[1]
    assert_allclose(found.belongs[12], found.share)  # an arm never seen
    assert_allclose(found.belongs.sum(axis=1), 1.0)
    rises = np.diff(found.risen)
    assert (rises >= -1e-9 * abs(found.risen[0])).all()
    assert found.settled
    for k, true in ((kind[0], TIRING), (kind[1], STEADY)):
        own = seen.weighing((kind[seen.arm] == k).astype(float))
        best = own.weight @ likelihoods(seen, found.chains[k])
        assert best > own.weight @ likelihoods(seen, true) - 20


def test_one_type_is_the_chain_of_all(mixed: Plays) -> None:
    seen, effort = streams(mixed), Effort(starts=1, steps=60)
    whole = learned(seen, effort)

    found = learn_types(seen, whole.chain, 12, 1, effort, Smoothing())

    assert (found.belongs == 1).all()
    assert_allclose(found.chains[0].play, whole.chain.play, atol=0.02)


def test_a_log_in_which_everything_moves_tells_all() -> None:
    plays = sampled([TIRING], np.random.default_rng(2), 150, 150, 4)
    seen = streams(plays)

    found = identify(seen, learned(seen), Smoothing())

    assert found.states == 2
    assert found.warnings == []
    assert {told.bond for told in found.told} == {Bond.REST, Bond.PLAY, Bond.SAME}
    assert found.singular_values[0] > 10 * found.errors[0]


def test_what_a_log_does_not_tell_is_said() -> None:
    """Nothing moves; and in the other, rests are all alike: there are none."""
    still = Chain(np.eye(2), np.eye(2), STEADY.observe, STEADY.prior)
    unmoved = streams(sampled([still], np.random.default_rng(3), 100, 60, 3))
    alone = streams(sampled([TIRING], np.random.default_rng(4), 100, 60, 1))

    nothing, no_rest = (
        identify(seen, learned(seen), Smoothing()) for seen in (unmoved, alone)
    )

    assert any("items rest" in warning for warning in nothing.warnings)
    assert any("plays move" in warning for warning in nothing.warnings)
    assert any("cannot tell play from rest" in said for said in nothing.warnings)
    assert any("items rest" in warning for warning in no_rest.warnings)
    assert not any("plays move" in warning for warning in no_rest.warnings)


def test_nothing_is_told_by_single_plays() -> None:
    values, errors = singular_values(streams(log([0, 1], [0, 0], [1, 0])), 2, 3, 0)

    assert (values == 0).all()
    assert np.isinf(errors).all()


def test_intervals_hold_what_is_true_and_shrink_with_users() -> None:
    plays = [
        sampled([TIRING], np.random.default_rng(5), users, 60, 3) for users in (50, 400)
    ]
    seen = [streams(each) for each in plays]
    found = [learned(each) for each in seen]
    drawn = []

    for each, known in zip(seen, found, strict=True):
        resample = partial(intervals, each, known, REWARD, Smoothing(), draws=30)
        one, again = resample(seed=1), resample(seed=1)
        assert (one.low.play == again.low.play).all()
        assert (one.low.observe <= known.chain.observe + 0.05).all()
        assert (one.high.observe >= known.chain.observe - 0.05).all()
        drawn.append(one)

    few, many = ((each.high.observe - each.low.observe).mean() for each in drawn)
    assert many < 0.8 * few
    low, high = (end.observe[0, :, 1] for end in (drawn[1].low, drawn[1].high))
    truth = TIRING.observe[0, :, 1]
    assert ((low - 0.05 < truth) & (truth < high + 0.05)).all()
