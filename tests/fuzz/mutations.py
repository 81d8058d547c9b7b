"""Bytes like those that a decoder takes, and worse."""

import random
from collections.abc import Callable, Sequence

NASTY = (
    b"\x00",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\xed\xa0\x80",
    b"\\ud800",
    b"\\u0000",
    b"NaN",
    b"Infinity",
    b"-0",
    b"1e999",
    b"9" * 400,
    b"[" * 200,
    b'{"a":' * 200,
    b"&a *a",
    b"!!python/object/apply:os.system ['true']",
    b"<<: ",
    b"\r\n",
    b'"',
    b",",
    b"\t",
    b"\x1f\x8b\x08\x00",
    b"PAR1",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff\xff\xff\xff\xff",
)


def mutated(seeds: Sequence[bytes], luck: random.Random) -> bytes:
    """One of some seeds, changed in a few places."""
    found = luck.choice(seeds)
    for _ in range(luck.randint(1, 6)):
        found = luck.choice(CHANGES)(found, seeds, luck)
    return found


def _flip(text: bytes, _seeds: Sequence[bytes], luck: random.Random) -> bytes:
    if not text:
        return text
    place = luck.randrange(len(text))
    return text[:place] + bytes([luck.randrange(256)]) + text[place + 1 :]


def _cut(text: bytes, _seeds: Sequence[bytes], luck: random.Random) -> bytes:
    begin, end = sorted(luck.randint(0, len(text)) for _ in range(2))
    return text[:begin] + text[end:]


def _repeat(text: bytes, _seeds: Sequence[bytes], luck: random.Random) -> bytes:
    begin, end = sorted(luck.randint(0, len(text)) for _ in range(2))
    return text[:end] + text[begin:end] * luck.randint(1, 3) + text[end:]


def _insert(text: bytes, _seeds: Sequence[bytes], luck: random.Random) -> bytes:
    place = luck.randint(0, len(text))
    return text[:place] + luck.choice(NASTY) + text[place:]


def _splice(text: bytes, seeds: Sequence[bytes], luck: random.Random) -> bytes:
    other = luck.choice(seeds)
    return text[: luck.randint(0, len(text))] + other[luck.randint(0, len(other)) :]


def _noise(text: bytes, _seeds: Sequence[bytes], luck: random.Random) -> bytes:
    place = luck.randint(0, len(text))
    return text[:place] + luck.randbytes(luck.randint(1, 16)) + text[place:]


CHANGES: Sequence[Callable[[bytes, Sequence[bytes], random.Random], bytes]] = (
    _flip,
    _cut,
    _repeat,
    _insert,
    _splice,
    _noise,
)
