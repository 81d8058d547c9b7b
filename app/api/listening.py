"""The two calls that an application makes all day, and reports of plays it made alone."""

from functools import partial
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query, Response

from app.api import observed
from app.api.context import Serving
from app.api.problems import responses
from app.api.schemas.fields import Id, PathId
from app.api.schemas.listening import (
    FeedbackForm,
    FeedbackTaken,
    NextPlay,
    SelectionForm,
)
from app.domain import EVERYTHING
from app.errors import FeedbackConflict, NothingToPlay, PlayNotFound, UnknownItems
from app.services import listening
from app.services.answers import answer_of

router = APIRouter(prefix="/v1", tags=["listening"])
Names = Annotated[list[Id], Query(max_length=1000)]


@router.get("/users/{user}/next", responses=responses(NothingToPlay, UnknownItems))
async def next_play(
    caller: Serving,
    user: PathId,
    tag: Names = [],  # noqa: B006 - read only
    candidate: Names = [],  # noqa: B006
    exclude: Names = [],  # noqa: B006
) -> NextPlay:
    """Show the play to offer now: the pending one, or one that is chosen now."""
    form = SelectionForm(tags=tag, candidates=candidate or None, exclude=exclude)
    return await _next(caller, user, form)


@router.post("/users/{user}/next", responses=responses(NothingToPlay, UnknownItems))
async def next_play_of(caller: Serving, user: PathId, form: SelectionForm) -> NextPlay:
    """Do the same, with filters too long for an address."""
    return await _next(caller, user, form)


@router.post(
    "/plays/{play}/feedback", responses=responses(PlayNotFound, FeedbackConflict)
)
async def give_feedback(
    caller: Serving,
    play: UUID,
    form: FeedbackForm,
    next: Annotated[bool, Query(description="also choose the next play")] = False,  # noqa: A002, FBT002
) -> FeedbackTaken:
    """Take the answer of a play, exactly once."""
    answer = answer_of(caller.context.settings, form.signal, form.fraction)
    feedback = await caller.database.run(
        partial(
            listening.give_feedback,
            live=caller.live,
            play_id=play,
            answer=answer,
            then=EVERYTHING if next else None,
        )
    )
    observed.answered(feedback)
    return FeedbackTaken.of(feedback)


async def _next(caller: Serving, user: str, form: SelectionForm) -> NextPlay:
    upcoming = await caller.database.run(
        partial(
            listening.next_play,
            live=caller.live,
            user_id=user,
            selection=form.selection(),
        )
    )
    observed.served(upcoming)
    return NextPlay.of(upcoming.offer)
