"""The loop that listeners live in: the next play, and its answer."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from uuid import UUID

from app.domain import (
    EVERYTHING,
    NO_ANSWER,
    Answer,
    ItemModel,
    Play,
    Reply,
    Report,
    Revision,
    Selection,
    Slate,
)
from app.errors import (
    Fault,
    FeedbackConflict,
    IdempotencyConflict,
    NothingToPlay,
    PlayNotFound,
)
from app.services import selections
from app.services.allotment import allotted
from app.services.answers import answer_of, is_repeated
from app.services.catalogue import Catalogue
from app.services.live import Live
from app.services.offers import Offer
from app.services.standing import Standing
from app.storage import plays, users
from app.storage.store import Store
from policies import Answered

NEVER_ANSWERED = Answer(NO_ANSWER)


@dataclass(frozen=True, slots=True)
class Next:
    """What to play now. `expired`: closed as never answered."""

    offer: Offer
    expired: Sequence[Play] = ()


@dataclass(frozen=True, slots=True)
class Feedback:
    """What became of an answer.

    slot:     the one after that in which the play took place
    repeated: the same answer had been given before, and nothing was changed
    learned:  what the answer taught, None if repeated
    chosen_by: name of the policy that chose the play, None if the user did
    """

    play: Play
    signal: str
    slot: int
    repeated: bool = False
    learned: Answered | None = None
    next: Next | None = None
    chosen_by: str | None = None


def next_play(
    store: Store, live: Live, user_id: str, selection: Selection, count: int = 1
) -> Next:
    """The pending plays if there are any, else new ones."""
    revision, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, revision)
    pool = selections.pool(catalogue, selection)
    now = datetime.now(UTC)
    pending = user.pending
    if pending is not None and now - pending.since <= live.pending_ttl:
        return Next(_offered_before(store, live, catalogue, pending, user.slot))
    standing = Standing.of(store, catalogue, user, now)
    expired = () if pending is None else pending.waiting
    for play in expired:
        standing.close(play, NEVER_ANSWERED)
    standing.keep_time(revision.clock)
    policy = allotted(store, live, revision, catalogue, user_id)
    offer = standing.choose(policy, pool, selection, count)
    standing.save()
    return Next(offer, expired)


def give_feedback(
    store: Store, live: Live, play_id: UUID, reply: Reply, then: int | None
) -> Feedback:
    """Take the answer of a play, exactly once; then, if asked, tell what comes next.

    then: how many plays to choose for the next slot, None: not asked
    """
    found = users.by_play(store, play_id)
    if found is None:
        raise PlayNotFound(play_id)
    revision, user, play = found
    catalogue = live.catalogue(store, revision)
    model = catalogue.model_of(play.item)
    if play.signal is not None:
        feedback = _given_before(play, model, reply)
        return replace(feedback, next=_next_if_any(store, live, user.id, then))
    answer = answer_of(model, reply)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    slot, learned = standing.close(play, answer)
    offer = None if then is None else _following(live, revision, standing, then)
    standing.save()
    return Feedback(
        play,
        answer.signal,
        slot + 1,
        learned=learned,
        next=None if offer is None else Next(offer),
        chosen_by=live.version(store, play.policy or 0).name,
    )


def report_play(store: Store, live: Live, user_id: str, report: Report) -> Feedback:
    """Take a play that the user chose alone, with its answer."""
    revision, user = users.by_id(store, user_id)
    catalogue = live.catalogue(store, revision)
    serial = catalogue.known_serial(report.item)
    model = catalogue.model_of(serial)
    before = None
    if report.key is not None:
        before = plays.by_idempotency_key(store, user_id, report.key)
    if before is not None:
        return _reported_before(before, serial, model, report.reply)
    answer = answer_of(model, report.reply)
    standing = Standing.of(store, catalogue, user, datetime.now(UTC))
    standing.keep_time(revision.clock)
    play = standing.report(serial, answer, report.key)
    learned = standing.learn(play, play.slot, answer)
    standing.save()
    return Feedback(play, answer.signal, standing.slot, learned=learned)


def _offered_before(
    store: Store, live: Live, catalogue: Catalogue, pending: Slate, slot: int
) -> Offer:
    policy = live.version(store, pending.waiting[0].policy or 0)
    return Offer.of(catalogue, pending, slot, policy)


def _following(
    live: Live, revision: Revision, standing: Standing, count: int
) -> Offer | None:
    """What else waits, or new plays; an answer is taken also where there are none."""
    store, catalogue = standing.store, standing.catalogue
    if standing.pending is not None:
        return _offered_before(store, live, catalogue, standing.pending, standing.slot)
    try:
        pool = selections.pool(catalogue, EVERYTHING)
    except NothingToPlay:
        return None
    standing.keep_time(revision.clock)
    policy = allotted(store, live, revision, catalogue, standing.user.id)
    return standing.choose(policy, pool, EVERYTHING, count)


def _next_if_any(
    store: Store, live: Live, user_id: str, count: int | None
) -> Next | None:
    if count is None:
        return None
    try:
        return next_play(store, live, user_id, EVERYTHING, count)
    except NothingToPlay:
        return None


def _given_before(play: Play, model: ItemModel, reply: Reply) -> Feedback:
    if not is_repeated(play, model, reply):
        field = "fraction" if reply.signal is None else "signal"
        raise FeedbackConflict(
            f"Play {play.id} was answered with {play.signal!r} before.",
            Fault(field, f"the answer given is {play.signal}", getattr(reply, field)),
        )
    return _as_it_was(play)


def _reported_before(
    play: Play, serial: int, model: ItemModel, reply: Reply
) -> Feedback:
    if play.item != serial or not is_repeated(play, model, reply):
        raise IdempotencyConflict(
            "The same key came with another item or answer before.",
            Fault("Idempotency-Key", "already used", play.idempotency_key),
        )
    return _as_it_was(play)


def _as_it_was(play: Play) -> Feedback:
    if play.signal is None or play.closed is None:
        raise ValueError(f"play {play.id} is pending")
    return Feedback(play, play.signal, play.closed + 1, repeated=True)
