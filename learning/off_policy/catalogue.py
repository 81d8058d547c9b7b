"""What could be played, and by which models."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from learning.chain import Chain
from learning.fitting import Fitted
from learning.plays import Bools, Plays
from policies import Ints, Model, ModelSet, Signals


@dataclass(frozen=True, slots=True, eq=False)
class Catalogue:
    """The arms of a log.

    Attributes:
        models: M models.
        model: (A,) row of each arm's model.
        signal: (M, K) number of each of the log's signals in each model.
        offered: (A,) whether the arm is a candidate, at all times.
        count: (M,) candidates of each model.
    """

    models: ModelSet
    model: Ints
    signal: Ints
    offered: Bools
    count: Ints


def catalogue(
    plays: Plays,
    models: Mapping[str, Model],
    model_of: Mapping[str, str],
    offered: Collection[str] | None = None,
) -> Catalogue:
    """Return the catalogue of a log, by models that are known.

    Args:
        plays: the log; an arm among its `arms` may never have been played.
        models: by name.
        model_of: name of each arm's model.
        offered: arms that are candidates, as they were at every play; None: all. Arms
            that came or went while the log was kept are for later: cut the log there.

    Raises:
        ValueError: an arm has no model, a model lacks a signal of the log, or nothing
            is offered.
    """
    names = list(models)
    row = {name: m for m, name in enumerate(names)}
    for arm in plays.arms:
        if model_of.get(arm) not in row:
            raise ValueError(f"model_of: {arm!r} has no model that is known")
    known = [models[name] for name in names]
    model = np.array([row[model_of[arm]] for arm in plays.arms], dtype=np.int64)
    candidates = np.array([offered is None or arm in offered for arm in plays.arms])
    if not candidates.any():
        raise ValueError("offered: there is no such arm")
    return Catalogue(
        ModelSet.of(known),
        model,
        np.array([_numbers(n, models[n], plays.signals) for n in names]),
        candidates,
        np.bincount(model[candidates], minlength=len(names)),
    )


def learned(
    plays: Plays, fitted: Fitted, offered: Collection[str] | None = None
) -> Catalogue:
    """Return the catalogue of a log, by models that were learned; see `catalogue`.

    An arm follows its likeliest type, as an item does in the service.

    Raises:
        ValueError: the models rest by the clock, which no policy plans with.
    """
    if fitted.recipe.in_time:
        raise ValueError("fitted: no policy plans with rests in time")
    models = {
        str(k): _model(chain, fitted, plays)
        for k, chain in enumerate(fitted.types.chains)
    }
    kinds = zip(plays.arms, fitted.types.of_arms.tolist(), strict=True)
    return catalogue(plays, models, {arm: str(kind) for arm, kind in kinds}, offered)


def _numbers(name: str, model: Model, signals: Sequence[str]) -> Sequence[int]:
    for signal in signals:
        if signal not in model.signals:
            raise ValueError(f"models: {name!r} knows no signal {signal!r}")
    return [model.signals.index(signal) for signal in signals]


def _model(chain: Chain, fitted: Fitted, plays: Plays) -> Model:
    mood = fitted.recipe.mood
    observe = chain.observe[0] if mood is None else chain.observe
    return Model(
        [str(state) for state in range(len(chain.prior))],
        chain.play,
        chain.rest,
        None,
        chain.prior,
        Signals(plays.signals, observe, plays.reward),
        mood=mood,
        shares=None if mood is None else fitted.shares,
    )
