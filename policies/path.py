"""The branch of a trajectory that is being simulated, and what simulating it needs.

The items played in a trajectory are its touched ones, at most one more with each play;
all others follow the schedule.
"""

from typing import NamedTuple

import numpy as np

from policies.arrays import Floats, Ints
from policies.compiled import compiled, inner
from policies.draws import Draws, Plan
from policies.model_set import ModelSet
from policies.schedule import Groups, Schedule


class Path(NamedTuple):
    """The plays from the first action to the current one, at depths h < D.

    Attributes:
        members: (L,) trajectories, in an order in which those that share the path lie
            side by side.
        end: (D,) where the range of trajectories ends that share the path down to h.
        touched: (D,) number of touched items at h, k.
        played: (D,) which of them is played at h.
        chance: (D,) chance of a like of that play.
        item: (D,) ordinal of the k-th touched item.
        group: (D,) its group.
        belief: (D * D, S) belief at h of the k-th touched item, in row h D + k.
    """

    members: Ints
    end: Ints
    touched: Ints
    played: Ints
    chance: Floats
    item: Ints
    group: Ints
    belief: Floats


class Imagined(NamedTuple):
    """All that a simulation reads and writes."""

    models: ModelSet
    groups: Groups
    plan: Plan
    schedule: Schedule
    draws: Draws
    path: Path


@compiled
def empty_path(plan: Plan, states: int) -> Path:
    """Make room for a path."""
    plays = len(plan.weights)
    return Path(
        np.empty(plan.trajectories, dtype=np.int64),
        np.empty(plays, dtype=np.int64),
        np.empty(plays, dtype=np.int64),
        np.empty(plays, dtype=np.int64),
        np.empty(plays),
        np.empty(plays, dtype=np.int64),
        np.empty(plays, dtype=np.int64),
        np.empty((plays * plays, states)),
    )


@inner
def touch(imagined: Imagined, h: int, group: int, item: int) -> None:
    """Play an item of `group` at depth h that was not played before it."""
    path = imagined.path
    k = path.touched[h]
    path.touched[h] = k + 1
    path.played[h] = k
    path.chance[h] = imagined.schedule.like[h, group]
    path.item[k] = item
    path.group[k] = group
    row = h * len(imagined.groups.model) + group
    for i in range(path.belief.shape[1]):
        path.belief[h * len(path.end) + k, i] = imagined.schedule.belief[row, i]
