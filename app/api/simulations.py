"""Policies tried on simulated users, before one is put in force."""

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Body
from fastapi.openapi.models import Example
from fastapi.responses import StreamingResponse

from app.api.context import Administering
from app.api.problems import responses
from app.api.schemas.simulations import SimulationForm, SimulationLine
from app.errors import (
    NothingToPlay,
    SimulatorBusy,
    TooLongToSimulate,
)
from app.services.simulations import Simulated, Step

router = APIRouter(prefix="/v1/admin", tags=["policy"])
EXAMPLES: dict[str, Example] = {
    "catalogue": {
        "summary": "against the policy in force",
        "value": {"policies": [{"name": "myopic"}], "runs": 200},
    },
    "paper": {
        "summary": "an example of the paper",
        "value": {
            "example": 2,
            "policies": [{"name": "myopic"}, {"name": "whittle"}],
            "runs": 1000,
        },
    },
}


class Lines(StreamingResponse):
    """JSON, an object a line, sent as it comes."""

    media_type = "application/x-ndjson"


@router.post(
    "/simulations",
    response_class=Lines,
    responses={
        200: {"model": SimulationLine, "description": "lines, the last with `result`"},
        **responses(NothingToPlay, TooLongToSimulate, SimulatorBusy),
    },
)
async def simulate(
    caller: Administering,
    form: Annotated[SimulationForm, Body(openapi_examples=EXAMPLES)],
) -> Lines:
    """Try policies on simulated users, and tell how far it is meanwhile.

    The same request gives the same result: whoever lost the connection asks again. One
    goes on at a time in a process, and ends when nobody listens any more.
    """
    told = await caller.context.simulator.begin(form.wanted())
    return Lines(_lines(told))


async def _lines(told: AsyncIterator[Step | Simulated]) -> AsyncIterator[str]:
    async for each in told:
        yield f"{SimulationLine.of(each).model_dump_json(exclude_unset=True)}\n"
