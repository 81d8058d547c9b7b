"""The two calls that an application makes all day, and the record they leave."""

from functools import partial
from typing import Annotated, TypeVar
from uuid import UUID

from fastapi import APIRouter, Query

from app.api import observed
from app.api.context import Serving
from app.api.problems import responses
from app.api.schemas.fields import NO_NAMES, Names, PathId
from app.api.schemas.listening import (
    Count,
    FeedbackForm,
    FeedbackTaken,
    NextPlay,
    NextSlate,
    SelectionForm,
    SlatePlay,
    Upcoming,
    upcoming,
)
from app.api.schemas.plays import PlayRecord
from app.domain import Selection
from app.errors import (
    FeedbackConflict,
    NothingToPlay,
    PlayNotFound,
    UnknownItems,
    UnknownSignal,
)
from app.services import explanations, listening
from app.services.answers import reply_of

router = APIRouter(prefix="/v1", tags=["listening"])
T = TypeVar("T", NextPlay, SlatePlay)
Explain = Annotated[bool, Query(description="also tell why this item")]


@router.get("/users/{user}/next", responses=responses(NothingToPlay, UnknownItems))
async def next_play(
    caller: Serving,
    user: PathId,
    tag: Names = NO_NAMES,
    candidate: Names = NO_NAMES,
    exclude: Names = NO_NAMES,
    count: Count = 1,
    explain: Explain = False,
) -> Upcoming:
    """Show the play to offer now: the pending one, or one that is chosen now.

    With `count`, or while several wait for their answers, `plays` lists them all.
    """
    selection = Selection(tuple(tag), tuple(candidate) or None, tuple(exclude))
    return await _next(caller, user, selection, count, explain=explain)


@router.post("/users/{user}/next", responses=responses(NothingToPlay, UnknownItems))
async def next_play_of(caller: Serving, user: PathId, form: SelectionForm) -> Upcoming:
    """Do the same, with filters too long for an address."""
    selection = form.selection()
    return await _next(caller, user, selection, form.count, explain=form.explain)


@router.get("/plays/{play}", responses=responses(PlayNotFound))
async def read_play(
    caller: Serving,
    play: UUID,
    explain: Explain = False,
) -> PlayRecord:
    """Read a play, and why it was chosen: the decision is taken again."""
    read = partial(explanations.record, live=caller.live, play_id=play, explain=explain)
    return PlayRecord.of_record(await caller.database.run(read))


@router.post(
    "/plays/{play}/feedback",
    responses=responses(PlayNotFound, FeedbackConflict, UnknownSignal),
)
async def give_feedback(
    caller: Serving,
    play: UUID,
    form: FeedbackForm,
    next: Annotated[bool, Query(description="also tell what to play next")] = False,  # noqa: A002 - the name of the query
    count: Count = 1,
) -> FeedbackTaken:
    """Take the answer of a play, exactly once.

    `next` is what else waits for its answer; where nothing does, it is chosen now.
    """
    reply = reply_of(caller.context.settings, form.signal, form.fraction)
    feedback = await caller.database.run(
        partial(
            listening.give_feedback,
            live=caller.live,
            play_id=play,
            reply=reply,
            then=count if next else None,
        )
    )
    observed.answered(feedback)
    if feedback.next is not None:
        caller.context.shadows.consider(feedback.next.offer.considered)
    return FeedbackTaken.of(feedback, count)


async def _next(
    caller: Serving, user: str, selection: Selection, count: int, *, explain: bool
) -> Upcoming:
    choose = partial(
        listening.next_play,
        live=caller.live,
        user_id=user,
        selection=selection,
        count=count,
    )
    found = await caller.database.run(choose)
    observed.served(found)
    caller.context.shadows.consider(found.offer.considered)
    shown = upcoming(found.offer, count)
    if not explain:
        return shown
    if isinstance(shown, NextSlate):
        plays = [await _explained(caller, play) for play in shown.plays]
        first = plays[0].explanation
        return shown.model_copy(update={"plays": plays, "explanation": first})
    return await _explained(caller, shown)


async def _explained(caller: Serving, shown: T) -> T:
    """A play together with why it was chosen."""
    why = partial(
        explanations.record, live=caller.live, play_id=shown.play, explain=True
    )
    record = PlayRecord.of_record(await caller.database.run(why))
    return shown.model_copy(update={"explanation": record.explanation})
