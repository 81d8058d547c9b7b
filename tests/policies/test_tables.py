"""How tables are built and stacked."""

from itertools import pairwise

import numpy as np
import pytest

from policies import (
    NO_TABLES,
    Mixture,
    ModelSet,
    Tables,
    build,
    build_all,
    create,
    grid,
    ready,
)
from policies.index_table import MOST_DIVISIONS, divisions_of
from tests.policies.instances import random_models, situation

MODELS = ModelSet.of(random_models(7, [2, 3, 4]))


@pytest.mark.parametrize("states", [2, 3, 4, 5, 6, 9])
@pytest.mark.parametrize("most", [100, 300, 2_000, 12_500])
def test_grids_are_nested_and_none_has_too_many_points_but_the_first(
    states: int, most: int
) -> None:
    divisions = divisions_of(states, most)

    assert all(finer == 2 * coarse for coarse, finer in pairwise(divisions))
    assert all(grid.size(states, finer) <= most for finer in divisions[1:])
    assert divisions[-1] <= MOST_DIVISIONS
    larger = 4 * (divisions[0] + 1)
    assert larger > MOST_DIVISIONS or grid.size(states, larger) > most


def test_a_table_is_the_same_to_the_bit() -> None:
    first, second = (build(MODELS, 1, 0.9, 300) for _ in range(2))

    assert first.whittle.tobytes() == second.whittle.tobytes()
    assert first.value.tobytes() == second.value.tobytes()
    assert first.error == second.error


def test_progress_rises_to_one() -> None:
    told: list[float] = []
    shares: list[float] = []

    build(MODELS, 2, 0.9, 300, told.append)
    build_all(MODELS, 0.9, 100, shares.append)

    assert all(before <= after for before, after in pairwise(told))
    assert 0 < told[0] < 0.01
    assert told[-1] == 1.0
    assert all(before <= after for before, after in pairwise(shares))
    assert len(shares) > len(MODELS.states)
    for whole in (1 / 3, 2 / 3, 1.0):
        assert any(share == pytest.approx(whole) for share in shares)
    assert shares[-1] == pytest.approx(1.0)


def test_tables_hold_those_of_all_models() -> None:
    tables = build_all(MODELS, 0.9, 300)

    for m in range(3):
        table = build(MODELS, m, 0.9, 300)
        for layers, values in (
            (tables.whittle, table.whittle),
            (tables.value, table.value),
        ):
            start = int(layers.start[m])
            kept = layers.values[start : start + values.size]
            assert np.array_equal(kept, values.ravel())
        assert (tables.low[m], tables.high[m]) == (table.low, table.high)


def test_tables_of_another_discount_are_refused() -> None:
    table = build(MODELS, 0, 0.9, 100)

    with pytest.raises(ValueError, match=r"discount: not all tables are of 0\.5"):
        Tables.of([table], 0.5)


def test_where_no_discount_is_needed_there_are_no_tables() -> None:
    assert build_all(MODELS, None) is NO_TABLES


def test_models_of_two_and_of_many_states_share_a_catalogue() -> None:
    models = ModelSet.of(random_models(1, [2, 21, 12]))
    case = situation(models, range(3), models.prior, [1, 1, 1])

    for name in ("whittle", "lagrangian", "exact_rollout"):
        scores = ready(create(name, {}), models)(case, 0)
        assert not isinstance(scores, Mixture)
        assert np.isfinite(scores).all()
