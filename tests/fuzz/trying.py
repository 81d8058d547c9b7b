"""Tries inputs of a decoder, and tells those that it cannot cope with."""

import random
import tempfile
import warnings
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tests.fuzz.decoders import DECODERS
from tests.fuzz.mutations import mutated


@dataclass(frozen=True, slots=True)
class Crash:
    """What a decoder raised that it should not, and for what."""

    decoder: str
    text: bytes
    error: Exception


def crashes(name: str, inputs: int, seed: int) -> list[Crash]:
    """The first few; the seeds themselves must be read without a word."""
    decoder, luck = DECODERS[name], random.Random(seed)  # noqa: S311 - reproducible
    found: list[Crash] = []
    with tempfile.TemporaryDirectory(prefix="encore-fuzz-") as place:
        folder = Path(place)
        for text in decoder.seeds:
            decoder.read(text, folder)
        for _ in range(inputs):
            text = mutated(decoder.seeds, luck)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    with suppress(*decoder.refuses):
                        decoder.read(text, folder)
            except Exception as error:  # noqa: BLE001 - that is what is looked for
                found.append(Crash(name, text, error))
    return found[:5]
