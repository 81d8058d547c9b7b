"""Who is in which arm."""

from collections import Counter
from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.services.split import SLICES, Split, divided, slice_of

USERS = [f"user-{number}" for number in range(100_000)]


def arms(split: Split) -> list[str]:
    """The arm of each slice."""
    found: list[str] = []
    for end, name in split:
        found += [name] * (end - len(found))
    return found


def test_users_are_spread_evenly_over_slices() -> None:
    """Chi-squared of 100 classes: 99 on average, 148 in one of a thousand cases."""
    for salt in ("", "a", "b"):
        found = Counter(slice_of(salt, user) // (SLICES // 100) for user in USERS)

        expected = len(USERS) / 100
        assert len(found) == 100
        assert sum((n - expected) ** 2 / expected for n in found.values()) < 148


def test_two_splits_know_nothing_of_each_other() -> None:
    found = Counter(
        (slice_of("a", user) * 4 // SLICES, slice_of("b", user) * 4 // SLICES)
        for user in USERS
    )

    expected = len(USERS) / 16
    assert sum((n - expected) ** 2 / expected for n in found.values()) < 38


def test_a_user_has_the_same_slice_on_every_machine_and_for_ever() -> None:
    assert [slice_of("salt", user) for user in ("ann", "Zoë", "🎧")] == [
        8874,
        3863,
        4852,
    ]


shares = (
    st.lists(st.integers(0, 50), min_size=2, max_size=6)
    .filter(any)
    .map(
        lambda weights: {
            f"arm-{place}": weight / sum(weights)
            for place, weight in enumerate(weights)
        }
    )
)


@given(st.lists(shares, min_size=1, max_size=4))
def test_nobody_moves_who_need_not(course: list[Mapping[str, float]]) -> None:
    split: Split = ()
    for wanted in course:
        before, split = split, divided(wanted, split)

        held, had = Counter(arms(split)), Counter(arms(before))
        assert sum(held.values()) == SLICES
        for name, share in wanted.items():
            assert held[name] == pytest.approx(share * SLICES, abs=1)
        if before:
            pairs = zip(arms(before), arms(split), strict=True)
            moved = sum(one != other for one, other in pairs)
            assert moved == sum((held - had).values())
