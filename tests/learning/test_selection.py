"""How many states and types are chosen."""

import numpy as np

from learning import NONE
from learning.chain import Chain
from learning.em import Effort
from learning.fitting import Recipe
from learning.selection import select
from tests.learning.logs import log, sampled
from tests.learning.test_types import STEADY, TIRING

QUICK = Recipe(effort=Effort(starts=4, steps=150))
THREE = Chain(
    np.array([[0.9, 0.05, 0.05], [0.05, 0.9, 0.05], [0.05, 0.05, 0.9]]),
    np.array([[0.98, 0.01, 0.01], [0.01, 0.98, 0.01], [0.01, 0.01, 0.98]]),
    np.array([[[0.99, 0.01], [0.5, 0.5], [0.01, 0.99]]]),
    np.full(3, 1 / 3),
)


def test_as_many_states_are_chosen_as_there_are() -> None:
    two = sampled([TIRING], np.random.default_rng(1), 100, 60, 4)
    three = sampled([THREE], np.random.default_rng(2), 120, 100, 2)
    done: list[None] = []

    found = select(two, QUICK, [3, 2, 2], [1], progress=lambda: done.append(None))
    more = select(three, QUICK, [2, 3, 4], [1])

    assert (found.states, found.types) == (2, 1)
    assert [each.states for each in found.tried] == [2, 3]
    assert len(done) == 2
    assert found.plays == 100 * 18
    assert more.states == 3
    assert min(each.worse for each in more.tried) == 0
    [few, *_] = more.tried
    assert few.worse > few.error > 0


def test_types_are_chosen_where_items_differ_in_kind() -> None:
    mixed = sampled([TIRING, STEADY], np.random.default_rng(1), 120, 120, 12)

    found = select(mixed, QUICK, [2], [1, 2])

    assert found.types == 2
    assert found.tried[0].worse > found.tried[0].error


def test_what_is_foretold_is_not_learned_from() -> None:
    """Answers of the last plays change what is foretold, not what is learned."""
    plays = sampled([TIRING], np.random.default_rng(3), 30, 40, 3)
    before = select(plays, QUICK, [2, 3], [1])
    held = ~plays.earliest(0.7)
    last = held & (plays.number == 39)
    plays.answer[last] = NONE

    after = select(plays, QUICK, [2, 3], [1])

    assert after.plays == before.plays - 30
    sums = [
        each.log_loss * found.plays
        for found in (before, after)
        for each in found.tried[:1]
    ]
    assert sums[0] > sums[1]


def test_of_nothing_to_foretell_the_smallest_sizes_follow() -> None:
    alone = select(log([0, 1], [0, 0], [1, 0]), QUICK, [2, 3], [1, 4])
    silent = select(log([0] * 10, [0] * 10, [NONE] * 7 + [1] * 3), QUICK, [3, 4], [2])

    assert (alone.states, alone.types, alone.tried) == (2, 1, ())
    assert (silent.states, silent.types) == (3, 2)
