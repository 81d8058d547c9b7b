"""Logs of users to whom arms were played at random."""

from collections.abc import Sequence

import numpy as np

from learning import Plays
from policies import Floats, Ints, Model
from policies.compiled import compiled


def sampled(kinds: Sequence[Model], users: int, slots: int, seed: int) -> Plays:
    """Let an arm of each model be played at random."""
    arms = len(kinds)
    arm = np.random.default_rng(seed).integers(0, arms, (users, slots))
    answer = _answers(
        seed,
        arm,
        np.stack([kind.play for kind in kinds]).cumsum(axis=2),
        np.stack([kind.rest for kind in kinds]).cumsum(axis=2),
        np.stack([kind.like for kind in kinds]),
        np.stack([kind.prior for kind in kinds]).cumsum(axis=1),
    )
    user = np.repeat(np.arange(users), slots)
    who, what = ([str(n) for n in range(count)] for count in (users, arms))
    return Plays(
        user, arm.ravel(), answer.ravel().astype(np.int8), None, None, who, what
    )


@compiled
def _answers(
    seed: int, arm: Ints, play: Floats, rest: Floats, like: Floats, prior: Floats
) -> Ints:
    np.random.seed(seed)  # noqa: NPY002 - compiled code knows no other
    answer = np.empty_like(arm)
    state = np.empty(len(like), dtype=np.int64)
    for user in range(arm.shape[0]):
        for j in range(len(like)):
            state[j] = np.searchsorted(prior[j], np.random.random() * prior[j, -1])  # noqa: NPY002
        for slot in range(arm.shape[1]):
            played = arm[user, slot]
            answer[user, slot] = np.random.random() < like[played, state[played]]  # noqa: NPY002
            for j in range(len(like)):
                moves = play[j, state[j]] if j == played else rest[j, state[j]]
                state[j] = np.searchsorted(moves, np.random.random() * moves[-1])  # noqa: NPY002
    return answer
