import dataclasses

import numpy as np
import pytest

from policies import Floats
from tests.policies.instances import paper_situation


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("belief", np.full((5, 3), 1 / 3)),
        ("belief", np.full((5, 4), 0.3)),
        ("belief", np.asfortranarray(np.full((5, 4), 0.25))),
        ("model", np.array([0, 1, 2, 3, 5])),
        ("model", np.array([0, 1, 2, 3, -1])),
        ("count", np.array([1, 1, 1, 1, 0])),
        ("count", np.ones(5, dtype=np.int32)),
        ("count", np.ones(4, dtype=np.int64)),
        ("rested", np.full(5, -1)),
        ("rested", np.full(10, 1)[::2]),
    ],
)
def test_a_wrong_field_is_named(field: str, value: Floats) -> None:
    case = dataclasses.replace(paper_situation(1), **{field: value})  # type: ignore[arg-type]

    with pytest.raises(ValueError, match=f"^{field}: "):
        case.check()
