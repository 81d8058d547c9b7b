"""The numbers of an index table as bytes: compressed, and the same to the bit.

Version 1, little endian: version (1 byte), three bytes unused, number of indices, of
layers of values and of values in a layer (4 bytes each); then, compressed by zlib, the
float64 numbers, the indices first. Of all numbers the first byte comes first, then the
second, and so on: neighbours differ in their last bytes only, so that this compresses
two to three times as well.
"""

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from app.storage.packing import UnknownFormat

HEADER = struct.Struct("<B3xIII")
VERSION = 1
FAST = 1  # zlib's higher levels take twice the time and gain a twentieth
WIDTH = 8

Floats = NDArray[np.float64]


def pack(index: Floats, value: Floats) -> bytes:
    """Pack indices (P,) and values (L, Q)."""
    numbers = np.concatenate((index, value.ravel())).astype("<f8", copy=False)
    by_place = numbers.view(np.uint8).reshape(-1, WIDTH).T
    header = HEADER.pack(VERSION, len(index), *value.shape)
    return header + zlib.compress(by_place.tobytes(), FAST)


def unpack(packed: bytes) -> tuple[Floats, Floats]:
    """Unpack indices (P,) and values (L, Q)."""
    if len(packed) < HEADER.size or packed[0] != VERSION:
        raise UnknownFormat(f"{len(packed)} bytes, version {packed[:1].hex()}")
    _, points, layers, size = HEADER.unpack_from(packed)
    try:
        plain = zlib.decompress(packed[HEADER.size :])
    except zlib.error as error:
        raise UnknownFormat(str(error)) from error
    if len(plain) != WIDTH * (points + layers * size):
        raise UnknownFormat(f"{len(plain)} bytes for {points} + {layers} x {size}")
    by_place = np.frombuffer(plain, np.uint8).reshape(WIDTH, -1)
    numbers = np.ascontiguousarray(by_place.T).view("<f8").ravel()
    return numbers[:points], numbers[points:].reshape(layers, size)
