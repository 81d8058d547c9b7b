"""Beliefs as bytes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from app.storage.packing import Entries, Felt, UnknownFormat, pack, unpack

COUNTS = st.integers(0, 2**62)
ANSWERS = st.tuples(st.integers(0, 2**30), st.integers(0, 1))
FELT = st.builds(
    Felt,
    slot=st.integers(-1, 2**40),
    began=st.integers(-(2**62), 2**62),
    recent=COUNTS,
    told=COUNTS,
    tendency=st.floats(0, 1),
    resumed=st.booleans(),
    answers=st.lists(ANSWERS, max_size=4).map(tuple),
)


@st.composite
def entries(draw: st.DrawFn) -> Entries:
    serials = sorted(draw(st.sets(st.integers(0, 2**62), max_size=20)))
    states = draw(st.integers(2, 6))
    chances = arrays(np.float64, (len(serials), states), elements=st.floats(0, 1))
    slots = arrays(np.int64, len(serials), elements=st.integers(0, 2**40))
    found = Entries(np.array(serials, np.int64), draw(slots), draw(chances))
    return replace(found, felt=draw(st.none() | FELT))


@given(entries())
def test_what_is_packed_is_unpacked_to_the_bit(kept: Entries) -> None:
    found = unpack(pack(kept), kept.belief.shape[1])

    assert np.array_equal(found.serial, kept.serial)
    assert np.array_equal(found.slot, kept.slot)
    assert np.array_equal(found.belief, kept.belief)
    assert found.belief.flags.writeable
    assert found.felt == kept.felt


@given(entries(), st.integers(1, 3))
def test_more_states_are_empty_and_come_off_again(kept: Entries, more: int) -> None:
    states = kept.belief.shape[1]
    wide = unpack(pack(kept), states + more)

    assert not wide.belief[:, states:].any()
    narrow = unpack(pack(wide), states)
    assert np.array_equal(narrow.belief, kept.belief)


@given(entries(), st.integers(1, 200))
def test_bytes_that_are_cut_short_are_refused(kept: Entries, cut: int) -> None:
    packed = pack(kept)

    with pytest.raises(UnknownFormat):
        unpack(packed[: max(1, len(packed) - cut)], 4)


def test_a_later_format_is_refused() -> None:
    with pytest.raises(UnknownFormat, match="version 9"):
        unpack(b"\x09" + pack(Entries.none(4))[1:], 4)
