"""Expected counts, against all hidden paths one by one."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.linalg import expm

from learning import NONE, Plays
from learning.chain import Chain, Counts
from learning.expectation import chances, expect, likelihoods
from learning.rests import moves_of, within
from learning.streams import streams
from policies import Floats, Ints, Model, ModelSet, answered, rested
from tests.learning.logs import chain, log, logs, moods

SEEDS = st.integers(0, 2**32)


def by_paths(plays: Plays, mood: Ints, true: Chain) -> Counts:
    """Go through every hidden path of every user and arm, slot by slot."""
    play, rest = np.zeros_like(true.play), np.zeros_like(true.rest)
    observe, prior = np.zeros_like(true.observe), np.zeros_like(true.prior)
    total = 0.0
    for user, arm in {*zip(plays.user.tolist(), plays.arm.tolist(), strict=True)}:
        rows = np.flatnonzero((plays.user == user) & (plays.arm == arm))
        when = plays.slot[rows].tolist()
        weights, paths = [], [*product(range(len(prior)), repeat=when[-1] + 1)]
        for path in paths:
            weight = true.prior[path[0]]
            for slot, (i, j) in enumerate(pairwise(path)):
                moved = true.play if slot in when else true.rest
                weight *= moved[i, j]
            for slot, row in zip(when, rows, strict=True):
                if plays.answer[row] != NONE:
                    weight *= true.observe[mood[row], path[slot], plays.answer[row]]
            weights.append(weight)
        chance = sum(weights)
        total += np.log(chance)
        for path, weight in zip(paths, np.array(weights) / chance, strict=True):
            prior[path[0]] += weight
            for slot, (i, j) in enumerate(pairwise(path)):
                (play if slot in when else rest)[i, j] += weight
            for slot, row in zip(when, rows, strict=True):
                if plays.answer[row] != NONE:
                    observe[mood[row], path[slot], plays.answer[row]] += weight
    return Counts(play, rest, observe, prior, total)


def assert_alike(one: Counts, other: Counts, rtol: float = 1e-9) -> None:
    for name in ("play", "rest", "observe", "prior", "likelihood"):
        assert_allclose(
            getattr(one, name), getattr(other, name), rtol, 1e-12, err_msg=name
        )


@settings(deadline=None, max_examples=60)
@given(logs(most=9, arms=2), SEEDS, st.integers(1, 2), st.integers(2, 3))
def test_counts_are_those_of_all_hidden_paths(
    plays: Plays, seed: int, classes: int, states: int
) -> None:
    mood, true = moods(plays, classes, seed), chain(seed, states, classes)

    found = expect(streams(plays, mood), true)

    assert_alike(found, by_paths(plays, mood, true))


@settings(deadline=None, max_examples=40)
@given(logs(most=40, users=6), SEEDS, st.integers(1, 9))
def test_parts_add_up_to_the_whole(plays: Plays, seed: int, most: int) -> None:
    whole, true = streams(plays, moods(plays, 2, seed)), chain(seed, 3, 2)

    parts = whole.parts(most)

    assert len(parts) <= most
    assert sum(map(len, parts)) == len(whole)
    users = [set(part.user.tolist()) for part in parts]
    assert sum(map(len, users)) == len(set().union(*users))
    found, *others = [expect(part, true) for part in parts]
    for other in others:
        found += other
    assert_alike(found, expect(whole, true))


@settings(deadline=None, max_examples=40)
@given(logs(most=20), SEEDS)
def test_weights_share_streams_out(plays: Plays, seed: int) -> None:
    seen, true = streams(plays), chain(seed)
    weight = np.random.default_rng(seed).random(len(seen))

    one, other = (expect(seen.weighing(share), true) for share in (weight, 1 - weight))

    assert_alike(one + other, expect(seen, true))
    assert one.prior.sum() == pytest.approx(weight.sum())
    assert one.likelihood == pytest.approx(weight @ likelihoods(seen, true))


@settings(deadline=None, max_examples=60)
@given(logs(most=30), SEEDS, st.integers(2, 4))
def test_chances_are_those_of_the_service(plays: Plays, seed: int, states: int) -> None:
    """The filter that beliefs are kept by says the same of each play."""
    true = chain(seed, states)
    names = [str(i) for i in range(states)]
    like = true.observe[0, :, 1]
    models = ModelSet.of([Model(names, true.play, true.rest, like, true.prior)])
    seen = streams(plays)

    found = chances(seen, true)

    row = np.zeros(1, dtype=np.int64)
    for n in range(len(seen)):
        belief, slot = models.prior.copy(), 0
        for p in range(seen.first[n], seen.first[n + 1]):
            at = int(plays.slot[seen.row[p]])
            belief = rested(models, row, belief, np.array([at - slot]))
            assert found[p, 1] == pytest.approx(belief[0] @ like, abs=1e-12)
            after = answered(models, 0, belief[0], int(seen.answer[p])).belief
            belief, slot = after[None], at + 1
    assert_allclose(found.sum(axis=1), 1.0)


@settings(deadline=None, max_examples=30)
@given(SEEDS, st.integers(2, 4), st.lists(st.floats(0, 1e6), min_size=1, max_size=4))
def test_rests_in_time_are_those_of_a_matrix_exponential(
    seed: int, states: int, lengths: list[float]
) -> None:
    """Integrals within them: Van Loan's, the corner of twice as large a matrix."""
    true = chain(seed, states, in_time=True)
    passed = np.array(sorted(set(lengths)))
    ends = np.random.default_rng(seed).random((len(passed), states, states))

    moves, found = moves_of(true, passed), within(true, passed, ends)

    expected = np.zeros_like(found)
    for length, moved, end in zip(passed, moves, ends, strict=True):
        assert_allclose(moved, expm(true.rest * length), rtol=1e-8, atol=1e-11)
        expected += corner(true.rest.T, end, length)
    off = ~np.eye(states, dtype=np.bool_)
    expected[off] *= true.rest[off]
    assert_allclose(found, expected, rtol=1e-7, atol=1e-9)


def corner(matrix: Floats, middle: Floats, length: float) -> Floats:
    size = len(matrix)
    both = np.block([[matrix, middle], [np.zeros_like(matrix), matrix]])
    found: Floats = expm(both * length)[:size, size:]
    return found


@pytest.mark.parametrize("in_time", [False, True])
def test_long_rests_lose_no_slot_and_no_second(*, in_time: bool) -> None:
    true = chain(5, 4, in_time=in_time)
    lengths = np.array([0.0, 1, 2, 3, 1000, 123_457])
    ends = np.zeros((6, 4, 4))
    moves = moves_of(true, lengths)
    for d, moved in enumerate(moves):
        ends[d] = 1.0 / moved.sum()  # so that each rest counts as one

    found = within(true, lengths, ends)

    seconds = np.trace(found) if in_time else found.sum()
    assert seconds == pytest.approx(lengths.sum(), rel=1e-9)


def test_rests_are_measured_from_the_users_first_play() -> None:
    plays = log(
        [0, 0, 0, 0, 1, 1], [0, 1, 0, 1, 1, 0], [1, 0, NONE, 1, 1, 0],
        [0.0, 60.0, 600.0, 7200.0, 50.0, 90.0],
    )  # fmt: skip

    in_slots, in_time = streams(plays), streams(plays, in_time=True)

    assert in_slots.arm.tolist() == [0, 1, 0, 1]
    assert in_slots.row.tolist() == [0, 2, 1, 3, 5, 4]
    assert in_slots.lengths[in_slots.rest].tolist() == [0, 1, 1, 1, 1, 0]
    assert in_time.lengths[in_time.rest].tolist() == [0, 600, 60, 7136, 40, 0]
    with pytest.raises(ValueError, match="time of each play"):
        streams(log([0], [0], [1]), in_time=True)
