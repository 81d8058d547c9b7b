"""The two calls that an application makes all day, and the record they leave."""

from functools import partial
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query

from app.api import observed
from app.api.context import Serving
from app.api.problems import responses
from app.api.schemas.fields import NO_NAMES, Names, PathId
from app.api.schemas.listening import (
    FeedbackForm,
    FeedbackTaken,
    NextPlay,
    SelectionForm,
)
from app.api.schemas.plays import PlayRecord
from app.domain import EVERYTHING, Selection
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
Explain = Annotated[bool, Query(description="also tell why this item")]


@router.get("/users/{user}/next", responses=responses(NothingToPlay, UnknownItems))
async def next_play(
    caller: Serving,
    user: PathId,
    tag: Names = NO_NAMES,
    candidate: Names = NO_NAMES,
    exclude: Names = NO_NAMES,
    explain: Explain = False,
) -> NextPlay:
    """Show the play to offer now: the pending one, or one that is chosen now."""
    selection = Selection(tuple(tag), tuple(candidate) or None, tuple(exclude))
    return await _next(caller, user, selection, explain=explain)


@router.post("/users/{user}/next", responses=responses(NothingToPlay, UnknownItems))
async def next_play_of(caller: Serving, user: PathId, form: SelectionForm) -> NextPlay:
    """Do the same, with filters too long for an address."""
    return await _next(caller, user, form.selection(), explain=form.explain)


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
    next: Annotated[bool, Query(description="also choose the next play")] = False,  # noqa: A002 - the name of the query
) -> FeedbackTaken:
    """Take the answer of a play, exactly once."""
    reply = reply_of(caller.context.settings, form.signal, form.fraction)
    feedback = await caller.database.run(
        partial(
            listening.give_feedback,
            live=caller.live,
            play_id=play,
            reply=reply,
            then=EVERYTHING if next else None,
        )
    )
    observed.answered(feedback)
    return FeedbackTaken.of(feedback)


async def _next(
    caller: Serving, user: str, selection: Selection, *, explain: bool
) -> NextPlay:
    choose = partial(
        listening.next_play, live=caller.live, user_id=user, selection=selection
    )
    upcoming = await caller.database.run(choose)
    observed.served(upcoming)
    play = NextPlay.of(upcoming.offer)
    if not explain:
        return play
    why = partial(
        explanations.record, live=caller.live, play_id=play.play, explain=True
    )
    record = PlayRecord.of_record(await caller.database.run(why))
    return play.model_copy(update={"explanation": record.explanation})
