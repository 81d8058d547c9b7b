"""What the guard finds: how models predict, and what it does about it."""

from functools import partial

from fastapi import APIRouter

from app.api.context import Administering
from app.api.schemas.guard import GuardView
from app.services import guard_reports

router = APIRouter(prefix="/v1/admin", tags=["policy"])


@router.get("/guard")
async def get_guard(caller: Administering) -> GuardView:
    """Tell how well each model predicts, and what would happen if it did not."""
    report = partial(guard_reports.report, settings=caller.context.settings)
    return GuardView.of(await caller.database.run(report))
