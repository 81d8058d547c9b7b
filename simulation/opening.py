"""Where runs begin: items of which none was ever played."""

from collections.abc import Sequence

import numpy as np

from policies import NEVER, Ints, Model, ModelSet, Situation, as_ints, untouched


def opening(
    models: Sequence[Model], counts: Sequence[int] | Ints | None = None
) -> Situation:
    """Return a group of items for each model, as a new user meets them.

    Args:
        models: M of them.
        counts: (M,) items of each; None: one.
    """
    stacked, groups = ModelSet.of(models), len(models)
    items = np.ones(groups) if counts is None else np.asarray(counts)
    return Situation(
        stacked,
        np.arange(groups),
        untouched(stacked, 0),
        as_ints(items),
        np.full(groups, NEVER),
    )
