"""Item models: how interest in the items that share one moves and is answered."""

from functools import partial
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Query, Response

from app.api.context import Administering, Serving
from app.api.problems import responses
from app.api.schemas.fields import PathId
from app.api.schemas.indexes import Discount, IndexReport
from app.api.schemas.model_views import ModelPage, ModelView
from app.api.schemas.models import ModelForm
from app.api.schemas.pages import CursorQuery, Limit, decode_text, encode
from app.domain import ItemModel
from app.errors import (
    InvalidCursor,
    ModelInUse,
    ModelNotFound,
    MoodsDiffer,
    SamplesApart,
    TooManyStates,
    UnusableModel,
)
from app.services import index_reports, models
from app.services.changes import Change

router = APIRouter(prefix="/v1", tags=["models"])
Version = Annotated[
    int | None, Query(ge=1, le=2**31 - 1, description="an earlier version")
]


@router.put(
    "/models/{model}",
    responses={
        201: {"model": ModelView},
        **responses(UnusableModel, MoodsDiffer, SamplesApart, TooManyStates),
    },
)
async def put_model(
    caller: Administering, model: PathId, form: ModelForm, response: Response
) -> ModelView:
    """Create a model, or a new version of it; the same again changes nothing."""
    put = await caller.database.run_in_turn(
        partial(models.put, new=form.model(model), by=caller.key.id)
    )
    caller.context.index_builder.wake()
    created = put.change is Change.CREATED
    response.status_code = HTTPStatus.CREATED if created else HTTPStatus.OK
    return ModelView.of(put.model, models.signals(put.model), put.warnings)


@router.get("/models/{model}", responses=responses(ModelNotFound))
async def get_model(
    caller: Serving, model: PathId, version: Version = None
) -> ModelView:
    """Show a model: its latest version, or an earlier one."""
    return _view(
        await caller.database.run(partial(models.find, model_id=model, version=version))
    )


@router.get("/models/{model}/index", responses=responses(ModelNotFound))
async def get_index(
    caller: Serving, model: PathId, discount: Discount = None
) -> IndexReport:
    """Tell how far the index table of a model is, and how far it can be trusted.

    Of the latest version, at one discount.
    """
    report = partial(index_reports.report, model_id=model, discount=discount)
    return IndexReport.of(await caller.database.run(report))


@router.get("/models", responses=responses(InvalidCursor))
async def list_models(
    caller: Serving, cursor: CursorQuery = None, limit: Limit = 100
) -> ModelPage:
    """List the models in order of id."""
    after = decode_text(cursor)
    found = await caller.database.run(
        partial(models.page, after=after, limit=limit + 1)
    )
    shown = found[:limit]
    return ModelPage(
        models=[_view(model) for model in shown],
        next=encode(shown[-1].id if len(found) > limit else None),
    )


@router.delete(
    "/models/{model}",
    status_code=HTTPStatus.NO_CONTENT,
    responses=responses(ModelNotFound, ModelInUse),
)
async def delete_model(caller: Administering, model: PathId) -> None:
    """Delete a model that no item uses; plays keep the versions they were made with."""
    await caller.database.run_in_turn(
        partial(models.retire, model_id=model, by=caller.key.id)
    )


def _view(model: ItemModel) -> ModelView:
    return ModelView.of(model, models.signals(model), models.warnings(model))
