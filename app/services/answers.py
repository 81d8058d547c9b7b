"""From what a client tells of a play to a signal of the item's model."""

from collections.abc import Mapping

from app.domain import LIKE, NO_ANSWER, SKIP, Answer, ItemModel, Play, Reply
from app.errors import Fault, InvalidRequest, UnknownSignal
from app.settings import Settings


def reply_of(settings: Settings, signal: str | None, fraction: float | None) -> Reply:
    """What a client tells; where it tells both, the signal counts."""
    if signal is None and fraction is None:
        raise InvalidRequest("Give either a signal or a fraction.")
    return Reply(signal, fraction, settings.like_fraction)


def answer_of(model: ItemModel, reply: Reply) -> Answer:
    """The signal that a client names, or that the share played means."""
    signal = _meant(model, reply) if reply.signal is None else reply.signal
    if signal is None or (signal != NO_ANSWER and signal not in model.answers):
        raise _unknown(model, reply)
    return Answer(signal, reply.fraction)


def is_repeated(play: Play, model: ItemModel, reply: Reply) -> bool:
    """Whether a play has this answer, also if its model knows it no longer."""
    if reply.signal is not None:
        return reply.signal == play.signal
    return reply.fraction == play.fraction or _meant(model, reply) == play.signal


def _meant(model: ItemModel, reply: Reply) -> str | None:
    """The signal with the highest share that was reached."""
    shares = _shares(model, reply.liked_from)
    if reply.fraction is None or shares is None:
        return None
    reached = [name for name, share in shares.items() if share <= reply.fraction]
    return max(reached, key=shares.__getitem__)


def _shares(model: ItemModel, liked_from: float) -> Mapping[str, float] | None:
    if model.signals is not None and model.signals.fractions is not None:
        return model.signals.fractions
    if set(model.answers) == {SKIP, LIKE}:
        return {SKIP: 0.0, LIKE: liked_from}
    return None


def _unknown(model: ItemModel, reply: Reply) -> UnknownSignal:
    known = f"known here: {', '.join((*model.answers, NO_ANSWER))}"
    if reply.signal is None:
        fault = Fault("fraction", f"is no signal; {known}", reply.fraction)
        return UnknownSignal(f"Model {model.id!r} says of no share what it is.", fault)
    fault = Fault("signal", f"unknown signal {reply.signal!r}; {known}", reply.signal)
    return UnknownSignal(f"Model {model.id!r} has no such signal.", fault)
