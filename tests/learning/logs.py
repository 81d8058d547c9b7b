"""Logs that are drawn, for tests."""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st

from learning import NONE, Plays
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


def lists(count: int, most: int, least: int = 0) -> st.SearchStrategy[list[int]]:
    return st.lists(st.integers(least, most), min_size=count, max_size=count)


@st.composite
def logs(draw: st.DrawFn, most: int = 12, users: int = 3, arms: int = 3) -> Plays:
    """Plays with some answers missing, at whole minutes."""
    count = draw(st.integers(1, most))
    user = sorted(draw(lists(count, users - 1)))
    arm, answer = draw(lists(count, arms - 1)), draw(lists(count, 1, NONE))
    minutes = draw(lists(count, 90))
    return log(user, arm, answer, (np.cumsum(minutes) * 60.0).tolist())


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


def sampled(
    true: Sequence[Chain], rng: np.random.Generator, users: int, slots: int, arms: int
) -> Plays:
    """Let arms be played at random; they follow the chains in turn."""
    size = len(true[0].prior)
    kinds = [true[arm % len(true)] for arm in range(arms)]
    first = [rng.choice(size, users, p=kind.prior) for kind in kinds]
    state = np.stack(first, axis=1)
    arm, answer = (np.empty((users, slots), dtype=np.int64) for _ in range(2))
    for slot in range(slots):
        arm[:, slot] = rng.integers(0, arms, users)
        for other, kind in enumerate(kinds):
            played, now = arm[:, slot] == other, state[:, other]
            liked = rng.random(users) < kind.observe[0, now, 1]
            answer[played, slot] = liked[played]
            moved = np.where(played[:, None], kind.play[now], kind.rest[now])
            drawn = (rng.random(users)[:, None] > moved.cumsum(axis=1)).sum(axis=1)
            state[:, other] = np.minimum(drawn, size - 1)
    who, what = ([str(n) for n in range(count)] for count in (users, arms))
    user = np.repeat(np.arange(users), slots)
    liked = answer.ravel().astype(np.int8)
    return Plays(user, arm.ravel(), liked, None, None, who, what)


def listened(users: int, count: int, arms: int, seed: int) -> Plays:
    """Plays of as many by each user, of arms that keep a like rate for each user.

    After a like, another is likelier. One answer in ten is missing.
    """
    rng = np.random.default_rng(seed)
    rates = rng.choice([0.1, 0.35, 0.65, 0.9], (users, arms))
    user = np.repeat(np.arange(users), count)
    arm = rng.integers(arms, size=len(user))
    answer = np.zeros(len(user), dtype=np.int64)
    for p in range(1, len(user)):
        answer[p] = rng.random() < 0.6 * rates[user[p], arm[p]] + 0.4 * answer[p - 1]
    answer[rng.random(len(user)) < 0.1] = NONE
    minutes = rng.integers(40, size=len(user)).cumsum()
    return log(user.tolist(), arm.tolist(), answer.tolist(), (60.0 * minutes).tolist())
