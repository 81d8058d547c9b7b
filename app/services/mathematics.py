"""Models as they are kept or described, as policies have them."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from app.domain import ItemModel, ItemSample, MoodRule
from policies import InvalidModel, Model, ModelSet, Mood, Signals


def stacked(versions: Sequence[ItemModel]) -> ModelSet:
    """Models as they are kept, for compiled code."""
    return ModelSet.of([mathematical(model) for model in versions])


def mathematical(model: ItemModel) -> Model:
    """A model as it is kept, validated."""
    signals, mood, shares = model.signals, None, None
    like: ArrayLike = model.like
    observe: ArrayLike = () if signals is None else signals.observe
    if model.mood is not None:
        mood, shares = mood_rule(model.mood.rule), model.mood.shares
        like, observe = model.mood.like or (), model.mood.observe or ()
    told = None
    if signals is not None:
        told = Signals(tuple(signals.names), observe, signals.reward)
    return Model(
        tuple(model.states),
        model.play,
        model.rest,
        None if signals else like,
        model.prior,
        told,
        samples=sampled(model.samples or (), model.states, told, mood, shares),
        mood=mood,
        shares=shares,
    )


def sampled(
    samples: Sequence[ItemSample],
    states: Sequence[str],
    signals: Signals | None,
    mood: Mood | None,
    shares: ArrayLike | None,
) -> Sequence[Model]:
    """The samples of a model, which share its states, signals and mood.

    An `InvalidModel` names the sample, too, as in "samples[2].play[0]".
    """
    found = []
    for number, sample in enumerate(samples):
        told = None
        if signals is not None:
            told = signals._replace(observe=sample.observe or ())
        chains = (states, sample.play, sample.rest, sample.like, sample.prior, told)
        try:
            found.append(Model(*chains, mood=mood, shares=shares))
        except InvalidModel as error:
            message = str(error).removeprefix(f"{error.field}: ")
            place = f"samples[{number}].{error.field}"
            raise InvalidModel(place, message) from error
    return found


def mood_rule(rule: MoodRule) -> Mood:
    """How answers make a mood, as it is kept, validated."""
    return Mood(rule.answers, rule.memory, tuple(rule.levels), rule.pause_s)
