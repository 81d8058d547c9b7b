"""A log in columns."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from learning import Plays
from tests.learning.logs import log, logs


def slots_by_clock(plays: Plays, slot_s: float) -> list[int]:
    """The same, play by play."""
    found: list[int] = []
    began, slot = 0.0, 0
    assert plays.seconds is not None
    for p, user in enumerate(plays.user):
        if p == 0 or plays.user[p - 1] != user:
            began, slot = float(plays.seconds[p]), 0
        elif plays.slot[p] != plays.slot[p - 1]:
            shown = int((plays.seconds[p] - began) // slot_s)
            slot = max(slot + 1, shown)
        found.append(slot)
    return found


@given(logs(), st.sampled_from([1.0, 60.0, 300.0, 7000.0]), st.data())
def test_slots_follow_a_clock_or_the_plays(
    plays: Plays, slot_s: float, data: st.DataObject
) -> None:
    steps = data.draw(st.lists(st.integers(0, 3), min_size=len(plays)))
    slots = np.cumsum(steps[: len(plays)])
    plays = replace(plays, slots=slots - slots[plays.first[:-1]][plays.user])

    assert plays.by_clock(slot_s).slot.tolist() == slots_by_clock(plays, slot_s)


def test_a_clock_needs_times() -> None:
    with pytest.raises(ValueError, match="time of each play"):
        log([0], [0], [1]).by_clock(60.0)
