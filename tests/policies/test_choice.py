import operator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policies import Mixture, chances, choose

SEEDS = st.integers(0, 2**63 - 1)


def test_the_highest_score_is_played() -> None:
    choice = choose(np.array([0.1, 0.7, 0.3]), np.array([5, 1, 9]), seed=3)

    assert choice == (1, 0, 1.0, 0)


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from([-1.0, 0.0, 2.5]), st.integers(1, 4)),
        min_size=1,
        max_size=8,
    ),
    SEEDS,
)
def test_a_choice_is_among_the_best(groups: list[tuple[float, int]], seed: int) -> None:
    scores = np.array([score for score, _ in groups])
    count = np.array([items for _, items in groups])

    choice = choose(scores, count, seed)

    best = scores == scores.max()
    assert best[choice.group]
    assert 0 <= choice.member < count[choice.group]
    assert choice.propensity == 1 / count[best].sum()
    assert choose(scores, count, seed) == choice


def test_ties_are_broken_uniformly_over_items() -> None:
    scores, count = np.array([1.0, 0.0, 1.0, 1.0]), np.array([1, 7, 4, 2])
    draws = 14_000

    wins: dict[tuple[int, int], int] = {}
    for seed in range(draws):
        choice = choose(scores, count, seed)
        wins[choice.group, choice.member] = (
            wins.get((choice.group, choice.member), 0) + 1
        )

    assert set(wins) == {(0, 0), (2, 0), (2, 1), (2, 2), (2, 3), (3, 0), (3, 1)}
    spread = np.sqrt(draws * (1 / 7) * (6 / 7))
    assert all(abs(won - draws / 7) < 4.5 * spread for won in wins.values())


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_score_that_is_not_finite_is_named(bad: float) -> None:
    with pytest.raises(ValueError, match=r"scores\[2\]"):
        choose(np.array([0.0, 1.0, bad, bad]), np.ones(4, dtype=np.int64), 0)


def test_nothing_to_choose_from_is_an_error() -> None:
    with pytest.raises(ValueError, match="scores"):
        choose(np.empty(0), np.empty(0, dtype=np.int64), 0)


def test_huge_groups_are_no_problem() -> None:
    choice = choose(np.zeros(2), np.array([10**12, 1]), 5)

    assert 0 <= choice.member < 10**12
    assert choice.propensity == 1 / (10**12 + 1)


def test_a_group_without_items_is_never_chosen() -> None:
    scores, count = np.array([9.0, 1.0, 1.0]), np.array([0, 2, 0])

    assert {choose(scores, count, seed).group for seed in range(50)} == {1}
    with pytest.raises(ValueError, match="nothing"):
        choose(scores, np.zeros(3, dtype=np.int64), 0)


def test_propensities_of_a_mixture_are_what_counting_finds() -> None:
    scores = np.array([[0.0, 0.0, 0.0], [1.0, 3.0, 3.0], [2.0, 1.0, 0.0]])
    mixture = Mixture(np.array([0.3, 0.5, 0.2]), scores)
    count, draws = np.array([2, 1, 3]), 30_000

    wins: dict[tuple[int, int], int] = {}
    chance: dict[tuple[int, int], float] = {}
    for seed in range(draws):
        choice = choose(mixture, count, seed)
        item = choice.group, choice.member
        wins[item] = wins.get(item, 0) + 1
        chance[item] = choice.propensity

    assert sum(chance.values()) == pytest.approx(1)
    assert chance[0, 0] == pytest.approx(0.3 / 6 + 0.2 / 2)
    assert chance[1, 0] == chance[2, 2] == pytest.approx(0.3 / 6 + 0.5 / 4)
    for item, won in wins.items():
        spread = np.sqrt(draws * chance[item] * (1 - chance[item]))
        assert abs(won - draws * chance[item]) < 4.5 * spread


@settings(deadline=None, max_examples=60)
@given(
    st.integers(1, 3).flatmap(
        lambda rows: st.lists(
            st.tuples(
                st.lists(st.integers(0, 2), min_size=rows, max_size=rows),
                st.integers(0, 3),
            ),
            min_size=1,
            max_size=6,
        ).filter(lambda groups: any(count for _, count in groups))
    ),
    SEEDS,
)
def test_the_chances_of_all_items_are_the_propensities_of_choices(
    groups: list[tuple[list[int], int]], seed: int
) -> None:
    scores = np.array([row for row, _ in groups], dtype=np.float64).T
    count = np.array([items for _, items in groups])
    mixture = Mixture(np.full(len(scores), 1 / len(scores)), scores)

    found = chances(mixture, count)

    choice = choose(mixture, count, seed)
    assert found[choice.group] == choice.propensity
    assert found @ count == pytest.approx(1)
    assert not found[count == 0].any()


def test_chances_need_items_and_finite_scores() -> None:
    with pytest.raises(ValueError, match="nothing"):
        chances(np.zeros(2), np.zeros(2, dtype=np.int64))
    with pytest.raises(ValueError, match="finite"):
        chances(np.array([0.0, np.nan]), np.ones(2, dtype=np.int64))


def test_places_draw_alone() -> None:
    scores, count = np.zeros(2), np.ones(2, dtype=np.int64)

    picks = [
        [choose(scores, count, seed, place).group for seed in range(400)]
        for place in (0, 1)
    ]

    first, second = picks
    assert 140 < sum(map(operator.eq, first, second)) < 260
