"""The catalogue's items."""

from functools import partial
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import AfterValidator

from app.api.context import Administering, Serving
from app.api.problems import responses
from app.api.schemas.fields import NO_NUL, PathId, storable
from app.api.schemas.items import ItemForm, ItemPage, ItemView
from app.api.schemas.pages import CursorQuery, Limit, decode_text, encode
from app.errors import InvalidCursor, ItemNotFound, UnknownModel
from app.services import items

router = APIRouter(prefix="/v1", tags=["items"])
Retired = Annotated[bool, Query(description="show retired items too")]
Search = Annotated[
    str,
    Query(
        max_length=200,
        description="those whose id or title holds this, in capitals or not",
        json_schema_extra={"pattern": NO_NUL},
    ),
    AfterValidator(storable),
]


@router.put(
    "/items/{item}", responses={201: {"model": ItemView}, **responses(UnknownModel)}
)
async def put_item(
    caller: Administering, item: PathId, form: ItemForm, response: Response
) -> ItemView:
    """Create or replace an item; a retired one returns, the same again is no change."""
    kept, created = await caller.database.run_in_turn(
        partial(items.put, new=form.item(item), by=caller.key.id)
    )
    response.status_code = HTTPStatus.CREATED if created else HTTPStatus.OK
    return ItemView.model_validate(kept)


@router.get("/items/{item}", responses=responses(ItemNotFound))
async def get_item(caller: Serving, item: PathId) -> ItemView:
    """Show an item, also a retired one."""
    return ItemView.model_validate(
        await caller.database.run(partial(items.find, item_id=item))
    )


@router.get("/items", responses=responses(InvalidCursor))
async def list_items(
    caller: Serving,
    cursor: CursorQuery = None,
    limit: Limit = 100,
    retired: Retired = False,
    search: Search = "",
) -> ItemPage:
    """List the items in order of id."""
    page = partial(
        items.page,
        after=decode_text(cursor),
        limit=limit + 1,
        retired=retired,
        search=search,
    )
    found = await caller.database.run(page)
    shown = found[:limit]
    return ItemPage(
        items=[ItemView.model_validate(item) for item in shown],
        next=encode(shown[-1].id if len(found) > limit else None),
    )


@router.delete(
    "/items/{item}",
    status_code=HTTPStatus.NO_CONTENT,
    responses=responses(ItemNotFound),
)
async def retire_item(caller: Administering, item: PathId) -> None:
    """Retire an item: it is recommended no more, and what was learned is kept."""
    await caller.database.run_in_turn(
        partial(items.retire, item_id=item, by=caller.key.id)
    )
