"""Publications of learned models: seen, taken back."""

from functools import partial

from fastapi import APIRouter

from app.api.context import Administering
from app.api.problems import responses
from app.api.schemas.pages import HIGHEST, CursorQuery, Limit, decode_number, encode
from app.api.schemas.publications import (
    PublicationPage,
    PublicationView,
    TakeBackForm,
    TakenBackView,
)
from app.errors import InvalidCursor, NoPublication, SamplesApart, TooManyStates
from app.services import publications

router = APIRouter(prefix="/v1/admin", tags=["models"])


@router.get("/publications", responses=responses(InvalidCursor))
async def list_publications(
    caller: Administering, limit: Limit = 100, cursor: CursorQuery = None
) -> PublicationPage:
    """List the publications of learned models, the latest first."""
    before = decode_number(cursor, HIGHEST)
    page = await caller.database.run(
        partial(publications.history, before=before, limit=limit)
    )
    return PublicationPage(
        publications=[
            PublicationView.model_validate(each) for each in page.publications
        ],
        next=encode(page.next),
    )


@router.post(
    "/publications/rollback",
    responses=responses(NoPublication, SamplesApart, TooManyStates),
)
async def roll_back_publication(
    caller: Administering, form: TakeBackForm | None = None
) -> TakenBackView:
    """Take back the latest publication that stands; again, the one before that.

    Models and items become what they were before it, all at once. What others have
    changed since stays as it is.
    """
    taken = await caller.database.run_in_turn(
        partial(
            publications.take_back,
            live=caller.live,
            note="" if form is None else form.note,
            by=caller.key.id,
        )
    )
    caller.context.index_builder.wake()
    return TakenBackView(
        publication=PublicationView.model_validate(taken.publication),
        items=taken.items,
        kept=taken.kept,
    )
