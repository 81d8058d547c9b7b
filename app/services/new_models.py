"""A model as a client describes it, and whether it is one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from app.domain import ItemSignals
from app.errors import Fault, UnusableModel
from app.services.catalogue import observed
from policies import InvalidModel, Model

BESIDE_SIGNALS = ("observe", "reward", "fractions")


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


def check(new: NewModel) -> Model:
    """Refuse what makes no pair of Markov chains, or no signals."""
    signals = observed(signals_of(new))
    try:
        model = Model(new.states, new.play, new.rest, new.like, new.prior, signals)
    except InvalidModel as error:
        field = error.field.replace("[", ".").replace("]", "")
        message = str(error).removeprefix(f"{error.field}: ")
        raise UnusableModel(f"{error}.", Fault(field, message)) from error
    if new.fractions is not None:
        _check_shares(model.signals, new.fractions)
    return model


def signals_of(new: NewModel) -> ItemSignals | None:
    """The signals that a model names, with all that they need."""
    if new.signals is None:
        for field in BESIDE_SIGNALS:
            if getattr(new, field) is not None:
                raise _unusable(field, "goes with signals, and there are none")
        if new.like is None:
            raise _unusable("like", "is needed, or else signals, observe and reward")
        return None
    if new.like is not None:
        raise _unusable("like", "is what signals, observe and reward imply: leave it")
    if new.observe is None or new.reward is None:
        missing = "observe" if new.observe is None else "reward"
        raise _unusable(missing, "is needed beside signals")
    return ItemSignals(new.signals, new.observe, new.reward, new.fractions)


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
