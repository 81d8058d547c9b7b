"""A model as a client describes it, and whether it is one."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from app.domain import ItemMood, ItemSample, ItemSignals
from app.errors import Fault, UnusableModel
from app.services.mathematics import mood_rule, sampled
from policies import InvalidModel, Model, Mood, Signals

BY_MOOD = ("like", "observe", "shares")
IN_SAMPLES = re.compile(r"(samples\.\d+\.)(like|observe)")
MOST_CHANCES = 2**20  # of a signal and a move, by mood
MOST_STATES = 64  # of a model, in all its samples


@dataclass(frozen=True, slots=True)
class NewModel:
    """A model as a client describes it: by `like`, or by `signals` of its own."""

    id: str
    states: Sequence[str]
    play: Sequence[Sequence[float]]
    rest: Sequence[Sequence[float]]
    like: Sequence[float] | None
    prior: Sequence[float]
    source: str = ""
    signals: Sequence[str] | None = None
    observe: Sequence[Sequence[float]] | None = None
    reward: Sequence[float] | None = None
    fractions: Mapping[str, float] | None = None
    mood: ItemMood | None = None
    samples: Sequence[ItemSample] | None = None


def check(new: NewModel) -> Model:
    """Refuse what makes no pair of Markov chains, no signals, or no mood."""
    _check_given(new)
    mood = None if new.mood is None else _mood(new, new.mood)
    signals = None
    if new.signals is not None:
        told = new.observe if new.mood is None else new.mood.observe
        signals = Signals(new.signals, told or (), new.reward or ())
    like = new.like if new.mood is None else new.mood.like
    shares = None if new.mood is None else new.mood.shares
    chains = (new.states, new.play, new.rest, like, new.prior, signals)
    try:
        model = Model(*chains, mood=mood, shares=shares)
        if new.samples is not None:
            _check_samples(new, new.samples)
            drawn = sampled(new.samples, new.states, signals, mood, shares)
            model = Model(*chains, samples=drawn, mood=mood, shares=shares)
    except InvalidModel as error:
        field = error.field.replace("[", ".").replace("]", "")
        if new.mood is not None:
            field = f"mood.{field}" if field.startswith(BY_MOOD) else field
            field = IN_SAMPLES.sub(r"\1mood.\2", field)
        message = str(error).removeprefix(f"{error.field}: ")
        raise _unusable(field, message) from error
    if new.fractions is not None:
        _check_shares(model.signals, new.fractions)
    return model


def signals_of(new: NewModel, model: Model) -> ItemSignals | None:
    """The signals that a model names, in its mean mood if it has one."""
    if new.signals is None or new.reward is None:
        return None
    observe = model.observe.tolist() if new.observe is None else new.observe
    return ItemSignals(new.signals, observe, new.reward, new.fractions)


def _check_given(new: NewModel) -> None:
    """Refuse a model that is not given by its likes or else by its signals, once."""
    mood, where = new.mood, "" if new.mood is None else "mood."
    if mood is not None:
        for field in ("like", "observe"):
            if getattr(new, field) is not None:
                raise _unusable(field, "is given by mood: leave it")
    like, observe = (
        (new.like, new.observe) if mood is None else (mood.like, mood.observe)
    )
    told = {f"{where}observe": observe, "reward": new.reward}
    if new.signals is None:
        _check_likes(f"{where}like", like, told | {"fractions": new.fractions})
        return
    if like is not None:
        implied = f"is what signals, {where}observe and reward imply: leave it"
        raise _unusable(f"{where}like", implied)
    for field, value in told.items():
        if value is None:
            raise _unusable(field, "is needed beside signals")


def _check_likes(field: str, like: object, beside: Mapping[str, object]) -> None:
    for other, value in beside.items():
        if value is not None:
            raise _unusable(other, "goes with signals, and there are none")
    if like is None:
        observe = next(iter(beside))
        raise _unusable(field, f"is needed, or else signals, {observe} and reward")


def _check_samples(new: NewModel, samples: Sequence[ItemSample]) -> None:
    """Refuse samples of too many states, or that are answered otherwise."""
    total = len(samples) * len(new.states)
    if total > MOST_STATES:
        most = f"{MOST_STATES} states in all, not {total}"
        raise _unusable("samples", f"may have {most}")
    told, left = ("like", "observe") if new.signals is None else ("observe", "like")
    where = "" if new.mood is None else "mood."
    for number, sample in enumerate(samples):
        if getattr(sample, told) is None:
            raise _unusable(f"samples.{number}.{where}{told}", "is needed")
        if getattr(sample, left) is not None:
            raise _unusable(f"samples.{number}.{where}{left}", f"give {told} instead")


def _mood(new: NewModel, mood: ItemMood) -> Mood:
    try:
        rule = mood_rule(mood.rule)
    except ValueError as error:
        field, _, message = str(error).partition(": ")
        raise _unusable(f"mood.{field}", message) from error
    signals = 2 if new.signals is None else len(new.signals)
    states = len(new.states) * len(new.samples or (1,))
    if rule.classes * signals * states**2 > MOST_CHANCES:
        raise _unusable("mood", f"has too many classes, {rule.classes}, for its model")
    return rule


def _check_shares(signals: Sequence[str], fractions: Mapping[str, float]) -> None:
    for name in fractions:
        if name not in signals:
            raise _unusable(f"fractions.{name}", "is none of the signals")
    shares = sorted(fractions.values())
    if shares[0] > 0:
        raise _unusable("fractions", "needs a signal for a share of 0")
    for lower, higher in pairwise(shares):
        if lower == higher:
            raise _unusable("fractions", f"has two signals for a share of {lower:g}")


def _unusable(field: str, message: str) -> UnusableModel:
    return UnusableModel(f"{field}: {message}.", Fault(field, message))
