"""Draws of paths, rests and chains are as likely as they should be."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import combinations, pairwise, product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from learning import NONE, Plays
from learning.bridges import halved, moves_within
from learning.chain import Chain
from learning.expectation import expect
from learning.fitting import Recipe, fit
from learning.maximization import Smoothing
from learning.posterior import Sampling, _counted, sample
from learning.rests import within
from learning.streams import streams
from policies import Floats
from tests.learning.logs import chain, log, moods, sampled

REWARD = np.array([0.0, 1.0])


def test_moves_within_rests_come_with_the_chances_of_their_paths() -> None:
    """All paths of a rest of five slots, by hand."""
    true, rng = chain(3, 2), np.random.default_rng(1)
    lengths = halved(np.array([5]))
    ends = np.zeros((len(lengths), 2, 2), dtype=np.int64)
    ends[-1, 0, 1] = 1
    weight: Counter[tuple[int, ...]] = Counter()
    for middle in product((0, 1), repeat=4):
        path = (0, *middle, 1)
        steps = list(pairwise(path))
        moves = tuple(steps.count((i, j)) for i in (0, 1) for j in (0, 1))
        weight[moves] += np.prod([true.rest[step] for step in steps])

    drawn = Counter(
        tuple(moves_within(true, lengths, ends, rng).ravel().tolist())
        for _ in range(3000)
    )

    assert lengths.tolist() == [0, 1, 2, 3, 5]
    assert drawn.keys() <= weight.keys()
    total = sum(weight.values())
    for moves, chance in weight.items():
        assert drawn[moves] / 3000 == pytest.approx(chance / total, abs=0.035)


def test_long_rests_are_drawn_as_they_are_expected() -> None:
    true, rng = chain(5, 3), np.random.default_rng(2)
    own = np.array([0, 3, 100, 777])
    lengths = halved(own)
    ends = np.zeros((len(lengths), 3, 3), dtype=np.int64)
    ends[np.searchsorted(lengths, own)] = rng.integers(0, 50, (4, 3, 3))
    moves = np.stack([np.linalg.matrix_power(true.rest, n) for n in lengths])

    drawn = np.mean(
        [moves_within(true, lengths, ends, rng) for _ in range(200)], axis=0
    )

    counted = np.flatnonzero(lengths > 0)
    expected = within(
        true, lengths[counted].astype(float), ends[counted] / moves[counted]
    )
    assert drawn.sum() == pytest.approx((ends.sum(axis=(1, 2)) * lengths).sum())
    assert_allclose(drawn, expected, rtol=0.01)


def test_paths_meet_on_average_what_is_expected() -> None:
    rng = np.random.default_rng(4)
    count = 60
    plays = log(
        sorted(rng.integers(0, 3, count).tolist()),
        rng.integers(0, 3, count).tolist(),
        rng.integers(NONE, 2, count).tolist(),
    )
    seen, true = streams(plays, moods(plays, 2, 1)), chain(6, 3, 2)
    lengths = halved(seen.lengths.astype(np.int64))
    expected = expect(seen, true)

    found = [_counted(seen.parts(), lengths, true, rng, map) for _ in range(1500)]

    for name in ("play", "observe", "prior"):
        past = {"play": "played", "observe": "observed", "prior": "begun"}[name]
        drawn = np.array([getattr(each, past) for each in found])
        sure = 5 * drawn.std(axis=0) / np.sqrt(len(drawn)) + 1e-9
        assert (np.abs(drawn.mean(axis=0) - getattr(expected, name)) <= sure).all()
    inner = np.array([moves_within(true, lengths, each.ends, rng) for each in found])
    sure = 5 * inner.std(axis=0) / np.sqrt(len(inner))
    assert (np.abs(inner.mean(axis=0) - expected.rest) <= sure).all()


def drawn_before(rng: np.random.Generator, smoothing: Smoothing) -> Chain:
    """A chain of two states from what is known before a log."""

    def rows(imagined: float, *shape: int) -> Floats:
        return rng.dirichlet(np.full(2, imagined + 1), shape)

    found = Chain(
        rows(smoothing.moves, 2),
        rows(smoothing.moves, 2),
        rows(smoothing.observe, 1, 2),
        rows(smoothing.prior, 1)[0],
    )
    by = np.argsort(found.observe[0, :, 1])
    ways = np.ix_(by, by)
    return Chain(
        found.play[ways], found.rest[ways], found.observe[:, by], found.prior[by]
    )


def told(each: Chain) -> list[float]:
    return [*each.observe[0, :, 1], each.play[0, 0], each.rest[1, 1], each.prior[0]]


def test_draws_are_those_of_the_exact_posterior() -> None:
    """Chains from the prior, weighed by the chance that they make the log."""
    rng, smoothing = np.random.default_rng(7), Smoothing()
    plays = sampled([chain(8, 2)], rng, 3, 10, 2)
    seen = streams(plays)
    before = [drawn_before(rng, smoothing) for _ in range(8000)]
    likelihood = np.array([expect(seen, each).likelihood for each in before])
    weight = np.exp(likelihood - likelihood.max())
    quantities = np.array([told(each) for each in before])
    mean = weight @ quantities / weight.sum()
    spread = np.sqrt(weight @ (quantities - mean) ** 2 / weight.sum())
    sampling = Sampling(kept=400, sweeps=80, seed=9)

    found = sample(seen, before[0], REWARD, smoothing, sampling)

    drawn = np.array([told(each) for each in found.chains])
    assert len(drawn) == 400
    worth = weight.sum() ** 2 / (weight**2).sum()
    assert worth > 500
    assert found.remembered(REWARD) < 0.1
    sure = 4 * np.sqrt(1 / worth + 1 / len(drawn))
    assert (np.abs(drawn.mean(axis=0) - mean) < sure * spread).all()
    assert_allclose(drawn.std(axis=0), spread, rtol=0.2)


def test_ranks_of_the_truth_among_draws_are_uniform() -> None:
    """Simulation-based calibration (Talts and others 2018), on ninety small logs."""
    rng, smoothing, bins = np.random.default_rng(11), Smoothing(), 5
    ranks = []
    for _ in range(90):
        true = drawn_before(rng, smoothing)
        seen = streams(sampled([true], rng, 6, 20, 2))
        seed = int(rng.integers(2**31))
        one = Sampling(kept=9, sweeps=30, seed=seed)
        found = sample(seen, true, REWARD, smoothing, one)
        below = np.array([told(each) for each in found.chains]) < told(true)
        ranks.append(below.sum(axis=0))

    counts = np.stack(
        [np.bincount(rank // 2, minlength=bins) for rank in np.array(ranks).T]
    )
    chi_square = ((counts - 18.0) ** 2 / 18.0).sum(axis=1)
    assert (chi_square < 18.5).all()  # four degrees of freedom: one in a thousand


@pytest.fixture
def plays() -> Plays:
    return sampled([chain(1, 3)], np.random.default_rng(3), 40, 40, 3)


def test_threads_draw_the_same_and_seeds_others(plays: Plays) -> None:
    seen, first, quick = streams(plays), chain(2, 3), Sampling(6, 3, 5)

    alone = sample(seen, first, REWARD, Smoothing(), quick)
    with ThreadPoolExecutor(2) as pool:
        beside = sample(seen, first, REWARD, Smoothing(), quick, pool.map)
    other = sample(seen, first, REWARD, Smoothing(), Sampling(6, 3, 6))

    for one, same, else_ in zip(alone.chains, beside.chains, other.chains, strict=True):
        assert (one.rest == same.rest).all()
        assert not np.allclose(one.rest, else_.rest)
        assert (np.diff(one.observe[0, :, 1]) >= 0).all()


def test_chains_by_the_clock_stay_as_they_are_learned_again(plays: Plays) -> None:
    timed = replace(plays, seconds=np.arange(0.0, 60.0 * len(plays), 60.0))
    seen, first = streams(timed, in_time=True), chain(1, 3, in_time=True)

    found = sample(seen, first, REWARD, Smoothing(), Sampling(kept=4))

    assert found.remembered(REWARD) == 1.0
    for one, other in combinations(found.chains, 2):
        assert one.in_time
        assert not np.allclose(one.play, other.play)


def test_draws_begin_as_far_apart_as_the_log_allows() -> None:
    """Where hidden paths are told badly, sweeps alone would stay where they begin."""
    true = Chain(
        np.array([[0.9, 0.1], [0.8, 0.2]]),
        np.array([[0.6, 0.4], [0.05, 0.95]]),
        np.array([[[0.9, 0.1], [0.15, 0.85]]]),
        np.array([0.2, 0.8]),
    )
    plays = sampled([true], np.random.default_rng(1), 30, 110, 4)
    seen, smoothing = streams(plays), Smoothing()
    learned = fit(plays, Recipe(states=2)).whole.chain

    short, long = (
        np.array([told(each) for each in posterior.chains])
        for posterior in (
            sample(seen, learned, REWARD, smoothing, Sampling(16, 20)),
            sample(seen, learned, REWARD, smoothing, Sampling(16, 200, 1)),
        )
    )

    assert (short.std(axis=0) > 0.5 * long.std(axis=0)).all()
