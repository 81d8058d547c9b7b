"""How well answers were predicted, beside what a sceptic would have said.

A prediction p of a reward r in [0, 1] is scored by its cross entropy,
-r log p - (1 - r) log(1 - p): least, on average, where p is the mean of r, and the log
loss where a play is liked or not. The sceptic knows the answers before each play: their
mean, or the user's own share, of the item as far as it was played, shrunk to the mean.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from policies import Floats, Ints

OUTCOME = np.dtype(
    [("user", "<u4"), ("item", "<u4"), ("predicted", "<f4"), ("reward", "<f4")]
)
Outcomes = NDArray[np.void]  # of OUTCOME, in the order of the plays
Outcome = tuple[int, int, float, float]

SURE = 0.001  # least chance that a prediction leaves to either answer, when scored
STRENGTH = 8.0  # answers that a wider share is worth, in a shrunk one
BINS = 10


@dataclass(frozen=True, slots=True)
class Scores:
    """Of a window of answered plays.

    model, constant, rate: mean cross entropy of the model's predictions, of the mean
                       of earlier answers, and of the user's shrunk share
    excess:            what the model's is above the lower of the others
    error:             standard error of that: users may differ, plays of one are alike
    predicted, answered: means
    calibration:       mean distance of the two, in ten classes of predictions
    """

    answers: int
    users: int
    model: float
    constant: float
    rate: float
    excess: float
    error: float
    predicted: float
    answered: float
    calibration: float


def number_of(user: str) -> int:
    """A number for a user, which is no name, and rarely another's too."""
    return int.from_bytes(blake2b(user.encode(), digest_size=4).digest(), "little")


def appended(packed: bytes, outcomes: Iterable[Outcome], most: int) -> bytes:
    """Packed outcomes with further ones, without the oldest where they are too many."""
    new = np.fromiter(outcomes, OUTCOME)
    return np.concatenate((unpacked(packed), new))[-most:].tobytes()


def unpacked(packed: bytes) -> Outcomes:
    return np.frombuffer(packed, OUTCOME)


def size(packed: bytes) -> int:
    """How many outcomes are packed."""
    return len(packed) // OUTCOME.itemsize


def scored(outcomes: Outcomes) -> Scores:
    """Score the predictions of a window, which must not be empty."""
    predicted = outcomes["predicted"].astype(np.float64)
    reward = outcomes["reward"].astype(np.float64)
    user = outcomes["user"].astype(np.int64)
    pair = user << 32 | outcomes["item"].astype(np.int64)
    mean = _mean_before(reward)
    own = _shrunk(*_before(user, reward), mean)
    rate = _shrunk(*_before(pair, reward), own)
    model = losses(predicted, reward)
    rivals = losses(mean, reward), losses(rate, reward)
    excess = model - min(rivals, key=lambda loss: float(loss.mean()))
    return Scores(
        len(outcomes),
        len(np.unique(user)),
        float(model.mean()),
        float(rivals[0].mean()),
        float(rivals[1].mean()),
        float(excess.mean()),
        _error(excess, user),
        float(predicted.mean()),
        float(reward.mean()),
        _calibration(predicted, reward),
    )


def losses(predicted: Floats, reward: Floats) -> Floats:
    """Return (P,) cross entropies."""
    chance = np.clip(predicted, SURE, 1 - SURE)
    lost: Floats = -reward * np.log(chance) - (1 - reward) * np.log1p(-chance)
    return lost


def _mean_before(reward: Floats) -> Floats:
    """Return (P,) means of the rewards before each play, and of one half."""
    total = np.cumsum(reward) - reward
    mean: Floats = (total + 0.5) / (np.arange(len(reward)) + 1)
    return mean


def _before(key: Ints, reward: Floats) -> tuple[Ints, Floats]:
    """Return (P,) number and total reward of earlier plays of the same key."""
    order = np.argsort(key, kind="stable")
    _, first, group = np.unique(key[order], return_index=True, return_inverse=True)
    total = np.cumsum(reward[order]) - reward[order]
    count = np.empty(len(key), np.int64)
    earned = np.empty(len(key))
    count[order] = np.arange(len(key)) - first[group]
    earned[order] = total - total[first[group]]
    return count, earned


def _shrunk(count: Ints, earned: Floats, base: Floats) -> Floats:
    share: Floats = (earned + STRENGTH * base) / (count + STRENGTH)
    return share


def _error(excess: Floats, user: Ints) -> float:
    """Standard error of the mean: by user or by play, whichever is larger."""
    plays = len(excess)
    _, group = np.unique(user, return_inverse=True)
    apart = excess - excess.mean()
    alone = np.sqrt((apart**2).sum()) / plays
    by_user = np.sqrt((np.bincount(group, apart) ** 2).sum()) / plays
    users = int(group.max()) + 1
    return float(max(alone, by_user * np.sqrt(users / max(users - 1, 1))))


def _calibration(predicted: Floats, reward: Floats) -> float:
    bins = np.minimum((predicted * BINS).astype(np.int64), BINS - 1)
    apart = np.bincount(bins, predicted - reward, BINS)
    return float(np.abs(apart).sum() / len(predicted))


def of(kept: Mapping[str, float | str]) -> Scores:
    """Scores as they were kept."""
    return Scores(**kept)  # type: ignore[arg-type]
