"""One user's beliefs as bytes: a header, then item serials, slots and beliefs.

Version 1, little endian: version (1 byte), states (1 byte), two bytes unused, number
of entries (4 bytes); then as many int64 serials, ascending, as many int64 slots, and
as many rows of float64 probabilities, one for each state.
"""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HEADER = struct.Struct("<BBHI")
VERSION = 1


class UnknownFormat(ValueError):
    """The bytes are not beliefs as this release writes them."""


@dataclass(frozen=True, slots=True)
class Entries:
    """The played items of one user whose interest has not yet returned.

    serial: (K,) items, ascending
    slot:   (K,) slot of each belief, the one after the item was played
    belief: (K, S)
    """

    serial: NDArray[np.int64]
    slot: NDArray[np.int64]
    belief: NDArray[np.float64]

    @classmethod
    def none(cls, states: int) -> "Entries":
        empty = np.empty(0, np.int64)
        return cls(empty, empty.copy(), np.empty((0, states)))


def pack(entries: Entries) -> bytes:
    count, states = entries.belief.shape
    return b"".join(
        (
            HEADER.pack(VERSION, states, 0, count),
            entries.serial.astype("<i8", copy=False).tobytes(),
            entries.slot.astype("<i8", copy=False).tobytes(),
            entries.belief.astype("<f8", copy=False).tobytes(),
        )
    )


def unpack(packed: bytes, states: int) -> Entries:
    """Entries for models of this many states; what differs is empty states."""
    if not packed:
        return Entries.none(states)
    if len(packed) < HEADER.size:
        raise UnknownFormat(f"{len(packed)} bytes")
    version, width, _, count = HEADER.unpack_from(packed)
    if version != VERSION or len(packed) != HEADER.size + count * (16 + 8 * width):
        raise UnknownFormat(f"version {version}, {count} entries, {len(packed)} bytes")
    writable = bytearray(packed)
    integers = np.frombuffer(writable, "<i8", 2 * count, HEADER.size)
    after = HEADER.size + 16 * count
    belief = np.frombuffer(writable, "<f8", count * width, after)
    fitted = _fitted(belief.reshape(count, width), states)
    return Entries(integers[:count], integers[count:], fitted)


def _fitted(belief: NDArray[np.float64], states: int) -> NDArray[np.float64]:
    missing = states - belief.shape[1]
    if missing > 0:
        return np.pad(belief, ((0, 0), (0, missing)))
    return belief if missing == 0 else belief[:, :states].copy()
