"""Logs that are drawn, for tests."""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st

from learning import Plays
from learning.chain import Chain
from policies import Ints


def log(
    users: Sequence[int],
    arms: Sequence[int],
    answers: Sequence[int],
    seconds: Sequence[float] | None = None,
) -> Plays:
    """Plays with users in ascending order."""
    return Plays(
        np.array(users, dtype=np.int64),
        np.array(arms, dtype=np.int64),
        np.array(answers, dtype=np.int8),
        None if seconds is None else np.array(seconds),
        None,
        [f"user {n}" for n in range(max(users, default=-1) + 1)],
        [f"arm {n}" for n in range(max(arms, default=-1) + 1)],
    )


@st.composite
def logs(draw: st.DrawFn, most: int = 12, users: int = 3, arms: int = 3) -> Plays:
    """Plays with some answers missing, at whole minutes."""
    count = draw(st.integers(1, most))
    few = {"min_size": count, "max_size": count}
    user = sorted(draw(st.lists(st.integers(0, users - 1), **few)))
    arm = draw(st.lists(st.integers(0, arms - 1), **few))
    answer = draw(st.lists(st.integers(-1, 1), **few))
    minutes = draw(st.lists(st.integers(0, 90), **few))
    return log(user, arm, answer, np.cumsum(minutes) * 60.0)


def chain(
    seed: int, states: int = 3, moods: int = 1, *, in_time: bool = False
) -> Chain:
    """A chain without any order."""
    rng = np.random.default_rng(seed)
    ones = np.ones(states)
    rest = rng.dirichlet(ones, states)
    if in_time:
        rest = rng.gamma(1.0, 1 / 3600, (states, states))
        np.fill_diagonal(rest, 0.0)
        rest -= np.diag(rest.sum(axis=1))
    like = rng.random((moods, states))
    return Chain(
        rng.dirichlet(ones, states),
        rest,
        np.stack((1 - like, like), axis=-1),
        rng.dirichlet(ones),
        in_time,
    )


def moods(plays: Plays, classes: int, seed: int) -> Ints:
    """Any mood at each play."""
    return np.random.default_rng(seed).integers(0, classes, len(plays))
