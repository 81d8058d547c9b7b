"""What a request is counted and logged as, once it is committed."""

import structlog

from app import metrics
from app.domain import NO_ANSWER, Play
from app.services.listening import Feedback, Next


def served(upcoming: Next) -> None:
    """Plays were offered; the first of them names the request."""
    play = upcoming.offer.first
    structlog.contextvars.bind_contextvars(user=play.user, play=str(play.id))
    _chosen(upcoming)


def _chosen(upcoming: Next) -> None:
    offer = upcoming.offer
    if offer.took is not None:
        metrics.decisions(offer.policy.name).observe(offer.took)
    for play in upcoming.expired:
        _closed(play, NO_ANSWER)


def answered(feedback: Feedback) -> None:
    """An answer was taken."""
    play = feedback.play
    structlog.contextvars.bind_contextvars(user=play.user, play=str(play.id))
    learned = feedback.learned
    if learned is not None:
        _closed(play, feedback.signal)
        if feedback.signal != NO_ANSWER:
            policy = feedback.chosen_by or play.source.value
            metrics.surprise(policy).observe(learned.surprise)
        if learned.impossible:
            metrics.IMPOSSIBLE.inc()
    if feedback.next is not None:
        structlog.contextvars.bind_contextvars(next=str(feedback.next.offer.first.id))
        _chosen(feedback.next)


def _closed(play: Play, signal: str) -> None:
    metrics.feedback(signal, play.source.value).inc()
