"""Random numbers that are a pure function of a seed and a position.

Philox4x32-10: Salmon, Moraes, Dror and Shaw (2011), "Parallel random numbers: as easy
as 1, 2, 3". A seed (0 <= seed < 2**63) takes the place of a generator: every decision
can be repeated from one stored integer, first actions share their random numbers simply
by asking for the same positions, and nothing has to be set up (a NumPy generator costs
15 microseconds to create, more than a myopic decision).
"""

from typing import TypeAlias

import numpy as np

from policies.compiled import compiled, inner

TIES = 0
ANSWERS = 1
ITEMS = 2
MIXTURE = 3
SUBSIDIES = 4

Words: TypeAlias = tuple[np.uint64, np.uint64, np.uint64, np.uint64]

_LOW = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_WEYL = (np.uint64(0x9E3779B9), np.uint64(0xBB67AE85))
_ROUNDS = 10


@inner
def philox(counter: Words, key: tuple[np.uint64, np.uint64]) -> Words:
    """Scramble a counter of four 32-bit words under a key of two."""
    a, b, c, d = counter
    left, right = key
    for _ in range(_ROUNDS):
        first = a * _MULTIPLIERS[0]
        second = c * _MULTIPLIERS[1]
        a = (second >> _HALF) ^ b ^ left
        b = second & _LOW
        c = (first >> _HALF) ^ d ^ right
        d = first & _LOW
        left = (left + _WEYL[0]) & _LOW
        right = (right + _WEYL[1]) & _LOW
    return a, b, c, d


@compiled
def uniform(seed: int, stream: int, i: int, j: int) -> float:
    """Return the number in [0, 1), of 53 random bits, at position (i, j) of a stream.

    Streams and i lie below 2**32, j below 2**63.
    """
    position, word = np.uint64(j), np.uint64(seed)
    counter = (np.uint64(i), position & _LOW, position >> _HALF, np.uint64(stream))
    high, low, _, _ = philox(counter, (word & _LOW, word >> _HALF))
    mantissa = (high >> np.uint64(5)) * np.uint64(1 << 26) + (low >> np.uint64(6))
    return np.float64(mantissa) * 2.0**-53
