"""One user's beliefs as bytes: a header, then item serials, slots and beliefs.

Version 1, little endian: version (1 byte), states (1 byte), two bytes unused, number
of entries (4 bytes); then as many int64 serials, ascending, as many int64 slots, and
as many rows of float64 probabilities, one for each state.

Version 2 goes on with the user's mood: slot, beginning, recent, told and tendency (8
bytes each), resumed (1 byte), number of answers (4 bytes), then a place and an answer
(4 bytes each) for each of them.
"""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HEADER = struct.Struct("<BBHI")
MOOD = struct.Struct("<qqqqd?I")
ANSWER = struct.Struct("<ii")
VERSION, WITH_MOOD = 1, 2


class UnknownFormat(ValueError):
    """The bytes are not beliefs as this release writes them."""


@dataclass(frozen=True, slots=True)
class Felt:
    """What a user's mood follows from.

    slot:    the last one that held plays, -1: none did
    began:   when it did, in microseconds since 1970
    recent, told, tendency: see `policies.MoodState`, as the slot began
    resumed: whether it began after a pause
    answers: of its plays, by place: 1 a like, 0 another
    """

    slot: int
    began: int
    recent: int
    told: int
    tendency: float
    resumed: bool
    answers: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Entries:
    """The played items of one user whose interest has not yet returned.

    serial: (K,) items, ascending
    slot:   (K,) slot of each belief, the one after the item was played
    belief: (K, S)
    felt:   None: it is not kept, as no model has a mood
    """

    serial: NDArray[np.int64]
    slot: NDArray[np.int64]
    belief: NDArray[np.float64]
    felt: Felt | None = None

    @classmethod
    def none(cls, states: int) -> "Entries":
        empty = np.empty(0, np.int64)
        return cls(empty, empty.copy(), np.empty((0, states)))


def pack(entries: Entries) -> bytes:
    count, states = entries.belief.shape
    version = VERSION if entries.felt is None else WITH_MOOD
    return b"".join(
        (
            HEADER.pack(version, states, 0, count),
            entries.serial.astype("<i8", copy=False).tobytes(),
            entries.slot.astype("<i8", copy=False).tobytes(),
            entries.belief.astype("<f8", copy=False).tobytes(),
            b"" if entries.felt is None else _pack_mood(entries.felt),
        )
    )


def unpack(packed: bytes, states: int) -> Entries:
    """Entries for models of this many states; what differs is empty states."""
    if not packed:
        return Entries.none(states)
    if len(packed) < HEADER.size:
        raise UnknownFormat(f"{len(packed)} bytes")
    version, width, _, count = HEADER.unpack_from(packed)
    end = HEADER.size + count * (16 + 8 * width)
    if version not in {VERSION, WITH_MOOD} or len(packed) < end:
        raise UnknownFormat(f"version {version}, {count} entries, {len(packed)} bytes")
    felt = _unpack_mood(version, packed[end:])
    writable = bytearray(packed)
    integers = np.frombuffer(writable, "<i8", 2 * count, HEADER.size)
    after = HEADER.size + 16 * count
    belief = np.frombuffer(writable, "<f8", count * width, after)
    fitted = _fitted(belief.reshape(count, width), states)
    return Entries(integers[:count], integers[count : 2 * count], fitted, felt)


def _pack_mood(felt: Felt) -> bytes:
    state = (felt.recent, felt.told, felt.tendency, felt.resumed)
    answers = b"".join(ANSWER.pack(*answer) for answer in felt.answers)
    return MOOD.pack(felt.slot, felt.began, *state, len(felt.answers)) + answers


def _unpack_mood(version: int, packed: bytes) -> Felt | None:
    if version == VERSION and not packed:
        return None
    if version != WITH_MOOD or len(packed) < MOOD.size:
        raise UnknownFormat(f"version {version}, {len(packed)} bytes after beliefs")
    slot, began, recent, told, tendency, resumed, count = MOOD.unpack_from(packed)
    if len(packed) != MOOD.size + count * ANSWER.size:
        raise UnknownFormat(f"{count} answers, {len(packed)} bytes after beliefs")
    answers = tuple(ANSWER.iter_unpack(packed[MOOD.size :]))
    return Felt(slot, began, recent, told, tendency, resumed, answers)


def _fitted(belief: NDArray[np.float64], states: int) -> NDArray[np.float64]:
    missing = states - belief.shape[1]
    if missing > 0:
        return np.pad(belief, ((0, 0), (0, missing)))
    return belief if missing == 0 else belief[:, :states].copy()
