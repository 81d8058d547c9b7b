"""What a request is counted and logged as, once it is committed."""

from collections.abc import Iterable

import structlog

from app import metrics
from app.domain import NO_ANSWER, Play, PolicyVersion
from app.logs import Seldom
from app.services.ladder import Cause, Decided
from app.services.listening import Feedback, Next
from app.services.playlists import Plan

MINUTE = 60.0

logger = structlog.get_logger()
told = Seldom(MINUTE)


def served(upcoming: Next) -> None:
    """Plays were offered; the first of them names the request."""
    play = upcoming.offer.first
    structlog.contextvars.bind_contextvars(user=play.user, play=str(play.id))
    _chosen(upcoming)


def _chosen(upcoming: Next) -> None:
    offer = upcoming.offer
    if offer.took is not None and offer.decided is not None:
        metrics.decisions(offer.policy.name).observe(offer.took)
        _decided(offer.policy, (offer.decided,))
    for play in upcoming.expired:
        _closed(play, NO_ANSWER)


def planned(plan: Plan) -> None:
    """Plays were planned."""
    _decided(plan.policy, plan.decided)


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


def _decided(policy: PolicyVersion, decided: Iterable[Decided]) -> None:
    """Tell of decisions that the policy itself did not take."""
    for decision in decided:
        if decision.slips:
            cause, rung = decision.slips[0].cause, decision.rung
            metrics.degraded(policy.name, str(rung), cause.value).inc()
            _missed(policy, decision)


def _missed(policy: PolicyVersion, decision: Decided) -> None:
    """A line for each rung and cause, at most once a minute; with the error, if any."""
    for slip in decision.slips:
        held = told.take((policy.version, slip.rung, slip.cause))
        if held is not None:
            tell = logger.error if slip.cause is Cause.FAILED else logger.warning
            tell(
                "a policy does not decide",
                policy=policy.name,
                version=policy.version,
                rung=slip.rung,
                cause=slip.cause.value,
                instead=decision.rung,
                held_back=held,
                exc_info=slip.error,
            )
