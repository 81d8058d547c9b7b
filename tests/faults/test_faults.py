"""Few rounds of each fault; `python -m tests.faults` does as many as you like."""

from pathlib import Path

import pytest

from tests.faults.faults import FAULTS

ROUNDS = {"workers_killed": 3}


@pytest.mark.parametrize("name", FAULTS)
def test_nothing_acknowledged_is_lost_or_doubled(name: str, tmp_path: Path) -> None:
    rounds = ROUNDS.get(name, 1)

    found = FAULTS[name](rounds, tmp_path)

    found.check()
    assert len(found.recovered) == rounds
