"""Forms of the clock that slots follow."""

from typing import Annotated

from pydantic import Field

from app.api.schemas.fields import Form
from app.services.clocks import LONGEST, SHORTEST


class ClockForm(Form):
    """How long a slot lasts, at most."""

    slot_s: Annotated[
        float,
        Field(
            strict=True,
            ge=SHORTEST,
            le=LONGEST,
            description="seconds, as models were learned",
        ),
    ]


class ClockView(Form):
    """The clock that slots follow."""

    version: Annotated[int, Field(description="counts how often it was set or stopped")]
    slot_s: Annotated[
        float | None,
        Field(description="seconds of a slot, null: slots are counted by plays alone"),
    ]
