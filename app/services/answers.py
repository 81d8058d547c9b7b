"""From what a client reports to a signal."""

from app.domain import Answer, Signal
from app.errors import InvalidRequest
from app.settings import Settings


def answer_of(
    settings: Settings, signal: Signal | None, fraction: float | None
) -> Answer:
    """A signal as it is, or that of the share of an item that was played."""
    if signal is not None:
        return Answer(signal)
    if fraction is None:
        raise InvalidRequest("Give either a signal or a fraction.")
    liked = fraction >= settings.like_fraction
    return Answer(Signal.LIKE if liked else Signal.SKIP, fraction)
