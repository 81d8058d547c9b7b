"""Which policies there are to choose from, and how those did that were chosen."""

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Query

from app.api.context import Administering, Serving
from app.api.schemas.overviews import OverviewView
from app.api.schemas.policy import CHOICES, PolicyChoices

router = APIRouter(prefix="/v1", tags=["policy"])


@router.get("/policies")
async def list_choices(_caller: Serving) -> PolicyChoices:
    """List the policies that there are, and the parameters that each takes."""
    return CHOICES


@router.get("/admin/overview")
async def read_overview(
    caller: Administering,
    hours: Annotated[float, Query(gt=0, le=24 * 366)] = 24.0,
    buckets: Annotated[int, Query(ge=1, le=500)] = 48,
) -> OverviewView:
    """Tell what was played and liked lately, by policy; of the latest 20 000 plays."""
    look = caller.context.overviews.look(timedelta(hours=hours), buckets)
    return OverviewView.of(await look)
