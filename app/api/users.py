"""What is held about a user, and what may come next."""

import asyncio
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Header, Query, Response

from app.api import observed
from app.api.context import Caller, Serving
from app.api.problems import responses
from app.api.schemas.fields import NO_NAMES, Chance, Id, Names, PathId
from app.api.schemas.listening import FeedbackTaken
from app.api.schemas.pages import (
    HIGHEST,
    CursorQuery,
    Limit,
    decode_number,
    decode_pair,
    encode,
)
from app.api.schemas.plays import PlayView
from app.api.schemas.users import (
    LONGEST,
    BeliefPage,
    BeliefView,
    ForecastView,
    Playlist,
    PlaylistForm,
    PlayPage,
    ReportForm,
    TimelineView,
    UserExport,
    mood_view,
)
from app.domain import Report, Selection
from app.errors import (
    IdempotencyConflict,
    InvalidCursor,
    ItemNotFound,
    NothingToPlay,
    UnknownItems,
    UnknownSignal,
    UserNotFound,
)
from app.services import forecasts, listening, playlists, profiles, timelines
from app.services.answers import reply_of
from app.services.playlists import Wanted

router = APIRouter(prefix="/v1/users/{user}", tags=["users"])
REPORTED_BEFORE: dict[int | str, dict[str, Any]] = {
    200: {"model": FeedbackTaken, "description": "It was reported before"}
}


@router.post(
    "/plays",
    status_code=201,
    responses=REPORTED_BEFORE
    | responses(UnknownItems, UnknownSignal, IdempotencyConflict),
)
async def report_play(
    caller: Serving,
    user: PathId,
    form: ReportForm,
    response: Response,
    idempotency_key: Annotated[
        Id | None, Header(description="the same report sent again is taken once")
    ] = None,
) -> FeedbackTaken:
    """Report a play that the user chose alone, with its answer."""
    reply = reply_of(caller.context.settings, form.signal, form.fraction)
    report = Report(form.item, reply, idempotency_key)
    take = partial(listening.report_play, live=caller.live, user_id=user, report=report)
    feedback = await caller.database.run(take)
    observed.answered(feedback)
    response.status_code = 200 if feedback.repeated else 201
    return FeedbackTaken.of(feedback)


@router.get("/plays", responses=responses(InvalidCursor))
async def list_plays(
    caller: Serving, user: PathId, limit: Limit = 100, cursor: CursorQuery = None
) -> PlayPage:
    """List the closed plays of a user, the latest first."""
    before = decode_pair(cursor, first=(HIGHEST, HIGHEST))
    read = partial(
        profiles.history, live=caller.live, user_id=user, before=before, limit=limit
    )
    page = await caller.database.run(read)
    views = [PlayView.of(play, shelf) for play, shelf in page.plays]
    return PlayPage(plays=views, next=encode(page.next))


@router.get("/beliefs", responses=responses(UnknownItems, InvalidCursor))
async def read_beliefs(
    caller: Serving,
    user: PathId,
    item: Names = NO_NAMES,
    limit: Limit = 100,
    cursor: CursorQuery = None,
) -> BeliefPage:
    """Read what is believed of played items, or of the items named."""
    named = partial(profiles.interest_in, live=caller.live, user_id=user, items=item)
    paged = partial(
        profiles.interest,
        live=caller.live,
        user_id=user,
        start=decode_number(cursor, first=0),
        limit=limit,
    )
    page = await caller.database.run(named if item else paged)
    views = [BeliefView.model_validate(belief) for belief in page.beliefs]
    return BeliefPage(
        user=user,
        slot=page.slot,
        mood=mood_view(page.mood),
        beliefs=views,
        next=encode(page.next),
    )


@router.get("/playlist", responses=responses(NothingToPlay, UnknownItems))
async def read_playlist(
    caller: Serving,
    user: PathId,
    tag: Names = NO_NAMES,
    candidate: Names = NO_NAMES,
    exclude: Names = NO_NAMES,
    length: Annotated[int, Query(ge=1, le=LONGEST)] = 20,
    repeats: Annotated[
        bool, Query(description="an item may be planned more than once")
    ] = False,
) -> Playlist:
    """Plan the next plays before any of them is answered; nothing changes.

    Without repeats the plan ends where no item is left.
    """
    selection = Selection(tuple(tag), tuple(candidate) or None, tuple(exclude))
    wanted = Wanted(selection, length, repeats)
    return await _planned(caller, user, wanted)


@router.post("/playlist", responses=responses(NothingToPlay, UnknownItems))
async def plan_playlist(caller: Serving, user: PathId, form: PlaylistForm) -> Playlist:
    """Do the same by another policy, or with filters too long for an address."""
    tried = None if form.policy is None else form.policy.described()
    wanted = Wanted(form.selection(), form.length, form.repeats, tried)
    return await _planned(caller, user, wanted)


@router.get("/items/{item}/forecast", responses=responses(ItemNotFound))
async def read_forecast(
    caller: Serving,
    user: PathId,
    item: PathId,
    slots: Annotated[int, Query(ge=1, le=1000)] = 20,
    threshold: Annotated[
        Chance | None, Query(description="expected reward that counts as back")
    ] = None,
) -> ForecastView:
    """Tell when an item is back: the expected reward as it rests."""
    read = partial(
        forecasts.of_item,
        live=caller.live,
        user_id=user,
        item=item,
        slots=slots,
        threshold=threshold,
    )
    return ForecastView.of(user, item, await caller.database.run(read))


@router.get("/items/{item}/timeline", responses=responses(ItemNotFound))
async def read_timeline(
    caller: Serving,
    user: PathId,
    item: PathId,
    slots: Annotated[
        int, Query(ge=1, le=1000, description="how many slots before the present one")
    ] = 100,
) -> TimelineView:
    """Tell how interest in an item has moved: its belief slot after slot, until now."""
    read = partial(
        timelines.of_item, live=caller.live, user_id=user, item=item, slots=slots
    )
    return TimelineView.of(user, item, await caller.database.run(read))


@router.get("/export", response_model=UserExport, responses=responses(UserNotFound))
async def export_user(caller: Serving, user: PathId) -> Response:
    """Export all that is held about a user."""
    read = partial(profiles.export, live=caller.live, user_id=user)
    held = await caller.database.run(read)
    body = await asyncio.to_thread(lambda: UserExport.of(held).model_dump_json())
    return Response(body, media_type="application/json")


@router.delete("", status_code=204, responses=responses(UserNotFound))
async def erase_user(caller: Serving, user: PathId) -> None:
    """Erase a user: plays, beliefs, all."""
    await caller.database.run(partial(profiles.erase, user_id=user, by=caller.key.id))


async def _planned(caller: Caller, user: str, wanted: Wanted) -> Playlist:
    plan = partial(playlists.plan, live=caller.live, user_id=user, wanted=wanted)
    planned = await caller.database.run(plan)
    if wanted.tried is None:
        observed.planned(planned)
    return Playlist.of(user, planned)
