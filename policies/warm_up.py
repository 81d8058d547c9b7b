"""Compiling ahead, so that no request waits for it."""

from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np

from policies.bayes import LIKE
from policies.belief import (
    answered,
    expected_like,
    forecast,
    replayed,
    rested,
    untouched,
)
from policies.choice import choose
from policies.model import Model
from policies.model_set import ModelSet
from policies.mood import Mood
from policies.parameters import Parameter, parameters
from policies.policy import Policy
from policies.ready import ready
from policies.registry import POLICIES, create
from policies.samples import conditioned
from policies.situation import NEVER, Situation


def warm_up(policies: Iterable[Policy] | None = None) -> None:
    """Compile what a service calls, or load it from the cache.

    Covers every belief function, `choose`, and some policies, without and with moods;
    if None, all of them in all variants, and thereby `bound`. That takes a minute the
    first time, a second from the cache; one policy takes a fraction of it.
    """
    even, like = [[0.5, 0.5], [0.5, 0.5]], [0.2, 0.8]
    plain = Model(("low", "high"), even, even, like, even[0])
    last = Mood(answers=1, memory=None, levels=(), pause_s=None)
    moody = Model(plain.states, even, even, [like] * 3, even[0], mood=last)
    _follow_beliefs(ModelSet.of([plain]))
    _follow_moods(ModelSet.of([moody]))
    followed = [*variants()] if policies is None else [*policies]
    for model in (plain, moody):
        situation = _begun(ModelSet.of([model]))
        for policy in followed:
            scores = ready(policy, situation.models, 60)(situation, 0)
            choose(scores, situation.count, 0)


def _begun(models: ModelSet) -> Situation:
    return Situation(
        models,
        np.zeros(2, dtype=np.int64),
        np.full((2, 2), 0.5),
        np.array([1, 2]),
        np.array([1, NEVER]),
    )


def _follow_beliefs(models: ModelSet) -> None:
    rows, belief = np.zeros(1, dtype=np.int64), untouched(models, 1)
    rested(models, rows, belief, rows)
    expected_like(models, rows, belief)
    answered(models, 0, belief[0], LIKE)
    replayed(models, 0, rows, rows)
    forecast(models, 0, belief[0], 1)
    conditioned(models, rows, belief, 1, 2)


def _follow_moods(models: ModelSet) -> None:
    one = np.ones(1, dtype=np.int64)
    _, state = models.mood_course(one, one, one == 0)
    models.mood_class(models.mood_after(state, LIKE), resumed=False)


def variants() -> Iterator[Policy]:
    """Yield each policy once for every combination of its choices and switches.

    One that follows another follows its default: all others are here by themselves.
    """
    for name, policy in POLICIES.items():
        switches = [p for p in parameters(policy) if p.choices or p.kind is bool]
        for values in product(*map(_values, switches)):
            names = (switch.name for switch in switches)
            yield create(name, dict(zip(names, values, strict=True)))


def _values(switch: Parameter) -> tuple[object, ...]:
    return switch.choices or (False, True)
