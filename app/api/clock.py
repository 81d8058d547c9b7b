"""The clock that slots follow: seen, set, stopped."""

from functools import partial

from fastapi import APIRouter

from app.api.context import Administering
from app.api.schemas.clock import ClockForm, ClockView
from app.services import clocks

router = APIRouter(prefix="/v1/admin", tags=["models"])


@router.get("/clock")
async def get_clock(caller: Administering) -> ClockView:
    """Tell whether interest rests by the clock, and how long a slot is."""
    return ClockView.model_validate(await caller.database.run(clocks.current))


@router.put("/clock")
async def set_clock(caller: Administering, form: ClockForm) -> ClockView:
    """Let interest rest by the clock, from now on: for models learned so.

    A user who comes back after an hour has moved on by an hour of slots.
    """
    put = partial(clocks.put, slot_s=form.slot_s, by=caller.key.id)
    return ClockView.model_validate(await caller.database.run(put))


@router.delete("/clock", status_code=204)
async def stop_clock(caller: Administering) -> None:
    """Let interest rest by plays alone, from now on."""
    await caller.database.run(partial(clocks.stop, by=caller.key.id))
