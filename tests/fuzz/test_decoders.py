"""Few inputs of each decoder, the same each time; `python -m tests.fuzz` tries more."""

import pytest

from tests.fuzz.decoders import DECODERS
from tests.fuzz.trying import crashes

INPUTS = 300


@pytest.mark.parametrize("name", DECODERS)
def test_what_is_not_read_is_refused(name: str) -> None:
    assert crashes(name, INPUTS, seed=1) == []
