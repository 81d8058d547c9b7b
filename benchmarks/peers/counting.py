"""Bandits that count the likes of each item: river, MABWiser and coba.

They see neither time nor the last answer, and tell no listeners apart: what a log holds
of others counts like answers of this one.
"""

from functools import partial

from coba.learners import BanditUCBLearner
from mabwiser.mab import MAB, LearningPolicy
from river import bandit, proba, stats

from benchmarks.peers.competitor import Competitor, learners
from benchmarks.peers.worlds import ITEMS

ALL = list(range(ITEMS))
SESSIONS = (1, 3, 20)


class River:
    def __init__(self, policy: bandit.base.Policy) -> None:
        self.policy = policy

    def greet(self) -> None:
        pass

    def choose(self) -> int:
        return int(self.policy.pull(ALL))

    def learn(self, item: int, *, liked: bool) -> None:
        self.policy.update(item, liked)


class Mabwiser:
    def __init__(self, seed: int) -> None:
        self.bandit = MAB(ALL, LearningPolicy.ThompsonSampling(), seed=seed)
        self.bandit.fit([], [])

    def greet(self) -> None:
        pass

    def choose(self) -> int:
        return int(self.bandit.predict())

    def learn(self, item: int, *, liked: bool) -> None:
        self.bandit.partial_fit([item], [int(liked)])


class Coba:
    def __init__(self, seed: int) -> None:
        self.learner = BanditUCBLearner(seed=seed)

    def greet(self) -> None:
        pass

    def choose(self) -> int:
        item, _chance = self.learner.predict(None, ALL)
        return int(item)

    def learn(self, item: int, *, liked: bool) -> None:
        self.learner.learn(None, item, int(liked), 1.0)  # counts, whatever the chance


def river_ucb(delta: float, fading: float | None, seed: int) -> River:
    mean = stats.Mean() if fading is None else stats.EWMean(fading)
    return River(bandit.UCB(delta, reward_obj=mean, seed=seed))


def river_thompson(likes: int, skips: int, seed: int) -> River:
    beta = proba.Beta(likes, skips)
    return River(bandit.ThompsonSampling(reward_obj=beta, seed=seed))


def competitors() -> list[Competitor]:
    ucb = {
        "delta 1.0": partial(river_ucb, 1.0, None),
        "delta 0.3": partial(river_ucb, 0.3, None),
        "delta 0.1": partial(river_ucb, 0.1, None),
        "delta 0.3, fading 0.05": partial(river_ucb, 0.3, 0.05),
    }
    thompson = {
        f"Beta({likes}, {skips})": partial(river_thompson, likes, skips)
        for likes, skips in [(1, 1), (1, 2), (2, 1)]
    }
    return [
        *learners("river UCB", ucb, SESSIONS),
        *learners("river Thompson", thompson, SESSIONS),
        *learners("MABWiser Thompson", {"": Mabwiser}, SESSIONS),
        *learners("coba UCB", {"": Coba}, SESSIONS),
    ]
