"""Listeners of whom all is known, to whom arms are played by known chances."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from learning import Plays
from learning.off_policy.choices import Choices
from policies import NEVER, Floats, Ints, Model

ALIKE = 1e-12  # scores that tie

Rule = Callable[[Floats, Ints], Floats]  # of beliefs (U, A, S) and rests (U, A)

TRUE = (
    Model(
        ("low", "high"),
        [[0.9, 0.1], [0.5, 0.5]],
        [[0.6, 0.4], [0.1, 0.9]],
        [0.1, 0.9],
        [0.4, 0.6],
    ),
    Model(
        ("low", "high"),
        [[0.7, 0.3], [0.1, 0.9]],
        [[0.95, 0.05], [0.3, 0.7]],
        [0.2, 0.7],
        [0.6, 0.4],
    ),
)
WRONG = tuple(
    Model(model.states, model.rest, model.play, like, [0.5, 0.5])
    for model, like in zip(TRUE, ([0.6, 0.8], [0.1, 0.3]), strict=True)
)
ARMS = ("a", "b", "c", "d", "e")
MODEL = np.array([0, 0, 0, 1, 1])
NAMES = ("first", "second")
MODEL_OF = {arm: NAMES[m] for arm, m in zip(ARMS, MODEL, strict=True)}


def named(models: Sequence[Model]) -> dict[str, Model]:
    return dict(zip(NAMES, models, strict=True))


def stacked(models: Sequence[Model], name: str) -> Floats:
    """A field of each arm's model, (A, ...)."""
    return np.stack([getattr(models[m], name) for m in MODEL])


def myopic(models: Sequence[Model]) -> Rule:
    like = stacked(models, "like")
    return lambda belief, _rested: ties((belief * like).sum(axis=-1))


def round_robin(_belief: Floats, rested: Ints) -> Floats:
    return ties(rested)


def uniform(_belief: Floats, rested: Ints) -> Floats:
    return np.full(rested.shape, 1 / rested.shape[1])


def best_fixed(models: Sequence[Model], discount: float) -> Rule:
    play, like = stacked(models, "play"), stacked(models, "like")
    worth = np.linalg.solve(np.eye(play.shape[1]) - discount * play, like[..., None])
    return lambda belief, _rested: ties((belief * worth[..., 0]).sum(axis=-1))


def mostly(rule: Rule, epsilon: float) -> Rule:
    """A rule, but for a share of uniform plays."""
    return lambda belief, rested: (
        (1 - epsilon) * rule(belief, rested) + epsilon * uniform(belief, rested)
    )


def ties(scores: Floats | Ints) -> Floats:
    """Chances by score (U, A), those of the highest alike."""
    best = scores >= scores.max(axis=1, keepdims=True) - ALIKE
    chances: Floats = best / best.sum(axis=1, keepdims=True)
    return chances


class Played(NamedTuple):
    """(T, U) each.

    Attributes:
        arm: that was played.
        answer: that was given.
        chance: with which the arm was chosen.
        truth: what the arm was truly worth.
        other: chance with which another rule would have chosen it.
        worth: what the other rule's choice was truly worth.
        expected: what the arm is worth by the models that are believed.
        promised: what the other rule's choice is worth by them.
    """

    arm: Ints
    answer: Ints
    chance: Floats
    truth: Floats
    other: Floats
    worth: Floats
    expected: Floats
    promised: Floats


@dataclass
class World:
    """U users, whose states nobody sees but the truth."""

    users: int
    seed: int
    models: Sequence[Model] = TRUE

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        self.rows = np.arange(self.users)
        prior = np.tile(stacked(self.models, "prior"), (self.users, 1, 1))
        self.belief = prior
        self.rested = np.full((self.users, len(ARMS)), NEVER)
        first = stacked(TRUE, "prior")[:, 1]
        self.state = (self.rng.random(self.rested.shape) < first).astype(np.int64)

    def play(self, rules: Sequence[Rule], other: Rule) -> Played:
        """Play one slot after the other, each by its rule."""
        told = [self._slot(rule, other) for rule in rules]
        return Played(*(np.stack(part) for part in zip(*told, strict=True)))

    def _slot(self, rule: Rule, other: Rule) -> Sequence[Floats | Ints]:
        chance = rule(self.belief, self.rested)
        wanted = other(self.belief, self.rested)
        upto = chance.cumsum(axis=1)
        arm = (self.rng.random((self.users, 1)) * upto[:, -1:] > upto).sum(axis=1)
        every = np.arange(len(ARMS))
        like = stacked(TRUE, "like")[every, self.state]
        at = self.rows, arm
        answer = (self.rng.random(self.users) < like[at]).astype(np.int64)
        by_belief = (self.belief * stacked(self.models, "like")).sum(axis=-1)
        self._move(arm, answer)
        return (
            *(arm, answer, chance[at], like[at], wanted[at], (wanted * like).sum(1)),
            *(by_belief[at], (wanted * by_belief).sum(axis=1)),
        )

    def _move(self, arm: Ints, answer: Ints) -> None:
        at, every = (self.rows, arm), np.arange(len(ARMS))
        play, rest = stacked(TRUE, "play"), stacked(TRUE, "rest")
        up = rest[every, self.state, 1]
        up[at] = play[arm, self.state[at], 1]
        self.state = (self.rng.random(up.shape) < up).astype(np.int64)
        observed = stacked(self.models, "observe")[arm, :, answer]
        learned = self.belief[at] * observed
        learned /= learned.sum(axis=1, keepdims=True)
        moved = np.einsum("us,ust->ut", learned, stacked(self.models, "play")[arm])
        self.belief = np.einsum(
            "uas,ast->uat", self.belief, stacked(self.models, "rest")
        )
        self.belief[at] = moved
        self.rested += self.rested != NEVER
        self.rested[at] = 0


def log_of(played: Played) -> Plays:
    """The log that the service would have of it."""
    slots, users = played.arm.shape
    return Plays(
        np.repeat(np.arange(users), slots),
        played.arm.T.ravel(),
        played.answer.T.ravel().astype(np.int8),
        None,
        played.chance.T.ravel(),
        [str(user) for user in range(users)],
        ARMS,
    )


def choices_of(played: Played) -> Choices:
    """The choices in it, beside the other rule's, user by user."""
    slots, users = played.arm.shape
    answer, chance, other, expected, promised = (
        getattr(played, name).T.ravel()
        for name in ("answer", "chance", "other", "expected", "promised")
    )
    return Choices(
        np.repeat(np.arange(users), slots),
        answer.astype(np.float64),
        chance,
        other,
        np.full(slots * users, len(ARMS)),
        expected,
        promised,
    )
