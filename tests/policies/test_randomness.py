import numpy as np
import pytest

from policies.randomness import ANSWERS, ITEMS, TIES, philox, uniform

ONES = 0xFFFFFFFF

# Known answers of Random123 (kat_vectors, philox4x32 10).
KNOWN = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((ONES,) * 4, (ONES,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("counter", "key", "words"), KNOWN)
def test_philox_gives_the_known_answers(
    counter: tuple[int, int, int, int],
    key: tuple[int, int],
    words: tuple[int, int, int, int],
) -> None:
    a, b, c, d = (np.uint64(word) for word in counter)
    left, right = (np.uint64(word) for word in key)

    assert [int(word) for word in philox((a, b, c, d), (left, right))] == list(words)


def test_a_uniform_number_is_the_first_53_bits_of_its_block() -> None:
    bits = ((0x6627E8D5 << 32) | 0xE169C58D) >> 11

    # 26 bits of the second word, as in the usual construction, not 21 of it
    assert abs(uniform(0, 0, 0, 0) - bits / 2**53) < 2**-26
    assert (
        uniform(0, 0, 0, 0) == ((0x6627E8D5 >> 5) * 2**26 + (0xE169C58D >> 6)) / 2**53
    )


def test_every_part_of_a_position_counts() -> None:
    positions = [
        (seed, stream, i, j)
        for seed in (0, 1, 2**32, 2**63 - 1)
        for stream in (TIES, ANSWERS, ITEMS)
        for i in (0, 1, 9_999)
        for j in (0, 1, 2**32, 2**40)
    ]

    numbers = {uniform(*position) for position in positions}

    assert len(numbers) == len(positions)


def test_numbers_are_uniform() -> None:
    numbers = np.array(
        [uniform(7, ANSWERS, i, j) for i in range(200) for j in range(50)]
    )

    assert numbers.min() >= 0
    assert numbers.max() < 1
    shares = np.histogram(numbers, bins=20, range=(0, 1))[0] / len(numbers)
    assert np.abs(shares - 0.05).max() < 5 * np.sqrt(0.05 * 0.95 / len(numbers))
    neighbours = np.corrcoef(numbers[:-1], numbers[1:])[0, 1]
    assert abs(neighbours) < 5 / np.sqrt(len(numbers))
