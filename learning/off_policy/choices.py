"""The choices of a log, beside those that another policy would have made."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import partial
from itertools import groupby
from typing import NamedTuple

import numpy as np

from learning.em import Spread
from learning.off_policy.beliefs import Beliefs, Listener
from learning.off_policy.candidates import candidates
from learning.off_policy.catalogue import Catalogue
from learning.plays import Answers, Bools, Plays
from policies import (
    Floats,
    Ints,
    Policy,
    Scorer,
    chances,
    expected_like,
    ready,
)


@dataclass(frozen=True, slots=True, eq=False)
class Choices:
    """D plays whose arm was chosen by a policy, with a chance that the log tells.

    Attributes:
        user: (D,) ascending; each user's in their order.
        reward: (D,) worth of the answer, NaN: none came.
        logged: (D,) chance with which the log's policy chose the arm.
        target: (D,) chance with which the other policy would have.
        offered: (D,) arms that could be chosen.
        expected: (D,) reward of the arm, as the models have it.
        promised: (D,) reward of the other policy's choice, as the models have it.
    """

    user: Ints
    reward: Floats
    logged: Floats
    target: Floats
    offered: Ints
    expected: Floats
    promised: Floats

    @property
    def answered(self) -> Bools:
        """Return (D,): whether there was an answer."""
        return ~np.isnan(self.reward)

    def of(self, rows: Bools) -> "Choices":
        """Return some of the choices."""
        return Choices(*(getattr(self, each.name)[rows] for each in fields(self)))

    def weights(self, in_a_row: int = 1) -> Floats:
        """Return (D,): how much likelier the other policy makes what led to a play.

        Args:
            in_a_row: over how many choices of the user, the play's own the last; over
                all that there are, if they are fewer.
        """
        each: Floats = self.target / self.logged
        total = each.copy()
        for back in range(1, in_a_row):
            same = self.user[back:] == self.user[:-back]
            total[back:] *= np.where(same, each[:-back], 1.0)
        return total


def choices(
    plays: Plays,
    catalogue: Catalogue,
    policy: Policy,
    seed: int = 0,
    spread: Spread = map,
) -> Choices:
    """Let a policy look at the situation of each play whose propensity is known.

    Users begin with the log: what they were played before is not known. Beliefs are
    those of the log, whatever was played and whoever chose it. Ties count by the chance
    of the lot. A policy that draws numbers to score draws its own: then its chance is
    that of the scores drawn, which on average is right.

    Args:
        plays: the log.
        catalogue: of its arms.
        policy: the other policy.
        seed: of what it draws.
        spread: how users are shared out, over threads at most.
    """
    judge = _Judge(catalogue, ready(policy, catalogue.models), policy.rest_matters)
    chosen = ~np.isnan(_propensity(plays))
    log = _Log(
        plays.first, plays.arm, plays.slot, _seconds(plays), plays.answer, chosen, seed
    )
    parts = spread(partial(_of_user, judge, log), range(len(plays.users)))
    told = np.concatenate([np.empty((0, 4)), *parts])
    worth = np.append(plays.reward, np.nan)  # NONE, -1, is its last
    return Choices(
        plays.user[chosen],
        worth[plays.answer[chosen]],
        _propensity(plays)[chosen],
        told[:, 0],
        told[:, 1].astype(np.int64),
        told[:, 2],
        told[:, 3],
    )


def _propensity(plays: Plays) -> Floats:
    known = plays.propensity
    return np.full(len(plays), np.nan) if known is None else known


def _seconds(plays: Plays) -> Floats:
    """Return when plays began; without times, all at once: nobody paused."""
    return np.zeros(len(plays)) if plays.seconds is None else plays.seconds


class _Log(NamedTuple):
    first: Ints
    arm: Ints
    slot: Ints
    seconds: Floats
    answer: Answers
    chosen: Bools
    seed: int


class _Judge(NamedTuple):
    catalogue: Catalogue
    scorer: Scorer
    rest_matters: bool

    def of(
        self, beliefs: Beliefs, before: Sequence[int], arm: int, plays: int, seed: int
    ) -> Sequence[float]:
        """Return target, offered, expected and promised; see `Choices`."""
        found = candidates(
            self.catalogue, beliefs, before, plays, rest_matters=self.rest_matters
        )
        situation, model = found.situation, int(self.catalogue.model[arm])
        chance = chances(self.scorer(situation, seed), situation.count)
        mood = situation.mood_class
        like = expected_like(situation.models, situation.model, situation.belief, mood)
        row, own = np.array([model]), beliefs.of(arm, model)[None]
        could = bool(self.catalogue.offered[arm]) and arm not in before
        return (
            float(chance[found.group(arm, model)]) if could else 0.0,
            float(situation.count.sum()),
            float(expected_like(situation.models, row, own, mood)[0]),
            float(chance * situation.count @ like),
        )


def _of_user(judge: _Judge, log: _Log, user: int) -> Floats:
    """Return (D, 4): what is told of the choices made for a user."""
    own = slice(log.first[user], log.first[user + 1])
    arms, answers = log.arm[own].tolist(), log.answer[own].tolist()
    slots, chosen = log.slot[own].tolist(), log.chosen[own].tolist()
    seconds = log.seconds[own].tolist()
    draws = np.random.default_rng((log.seed, user))
    seeds = draws.integers(0, 2**53, len(arms)).tolist()
    listener = Listener(judge.catalogue, np.unique(log.arm[own]))
    told: list[Sequence[float]] = []
    begun: float | None = None
    for slot, group in groupby(range(len(arms)), key=slots.__getitem__):
        rows = list(group)
        waited = None if begun is None else seconds[rows[0]] - begun
        beliefs, begun = listener.beliefs(slot, waited), seconds[rows[0]]
        together = [arms[row] for row in rows]
        for place, row in enumerate(rows):
            if chosen[row]:
                before = together[:place]
                given = judge.of(beliefs, before, arms[row], len(rows), seeds[row])
                told.append(given)
        for row in rows:
            listener.take(beliefs, slot, arms[row], answers[row])
    return np.reshape(told, (-1, 4))
