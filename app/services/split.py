"""Who is in which arm: told by a hash of the user, and by nothing that happened.

Hashes are divided into slices, and slices among arms. When shares change, an arm that
shrinks gives up as many slices as it must, and one that grows takes those: nobody else
is moved, which no rule without a memory can promise.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from itertools import groupby
from operator import itemgetter
from typing import TypeAlias

from app.domain import Experiment

SLICES = 10_000
NOBODY = ""

Split: TypeAlias = Sequence[tuple[int, str]]


def arm_of(experiment: Experiment, user: str) -> str:
    """The arm of a user, which may be the holdout."""
    place = slice_of(experiment.salt, user)
    return experiment.split[bisect_right(experiment.split, place, key=itemgetter(0))][1]


def slice_of(salt: str, user: str) -> int:
    """The slice of a user: of any two salts, that under one tells nothing of the other.

    The same on every machine, and for ever.
    """
    digest = blake2b(f"{salt}:{user}".encode(), digest_size=8).digest()
    return int.from_bytes(digest) * SLICES >> 64


def divided(shares: Mapping[str, float], before: Split = ()) -> Split:
    """Divide all slices by shares of sum one; move as few as possible."""
    wanted = _counts(shares)
    slices = _unrolled(before)
    for name in {*slices} - {NOBODY}:
        held = [place for place, whose in enumerate(slices) if whose == name]
        for place in held[wanted.get(name, 0) :]:
            slices[place] = NOBODY
    free = iter([place for place, whose in enumerate(slices) if whose == NOBODY])
    for name, count in wanted.items():
        for _ in range(count - slices.count(name)):
            slices[next(free)] = name
    return _rolled(slices)


def _counts(shares: Mapping[str, float]) -> Mapping[str, int]:
    """Slices of each share; what rounding leaves goes to those who lost most by it."""
    exact = {name: share * SLICES for name, share in shares.items()}
    counts = {name: int(count) for name, count in exact.items()}
    lost = sorted(exact, key=lambda name: counts[name] - exact[name])
    for name in lost[: SLICES - sum(counts.values())]:
        counts[name] += 1
    return counts


def _unrolled(split: Split) -> list[str]:
    slices: list[str] = []
    for end, name in split:
        slices += [name] * (end - len(slices))
    return slices or [NOBODY] * SLICES


def _rolled(slices: Sequence[str]) -> Split:
    split, end = [], 0
    for name, run in groupby(slices):
        end += sum(1 for _ in run)
        split.append((end, name))
    return split
