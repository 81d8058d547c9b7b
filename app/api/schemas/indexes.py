"""Forms of index tables: how far they are, and how far they can be trusted."""

from datetime import datetime
from typing import Annotated, Self

from fastapi import Query
from pydantic import Field

from app.api.schemas.fields import Form
from app.domain import Precision
from app.services.index_reports import MOST_DISCOUNT, Report, State

Discount = Annotated[
    float | None,
    Query(
        ge=0,
        le=MOST_DISCOUNT,
        allow_inf_nan=False,
        description="left out: that of the policy in force, else 0.95",
    ),
]


class IndexReport(Form):
    """The index table of a model; what is not known yet is null."""

    model: str
    version: int
    discount: float
    state: Annotated[
        State,
        Field(
            description="of the full table: `waiting` to be built, `building`, `ready`;"
            " `none`: not wanted, since nothing uses this discount, or not possible,"
            " since the model has too many states"
        ),
    ]
    progress: Annotated[
        float, Field(ge=0, le=1, description="share of the full table that is built")
    ]
    precision: Annotated[
        Precision | None, Field(description="of the table in use, which the rest is of")
    ]
    indexable: Annotated[
        bool | None,
        Field(
            description="whether resting, once best, stays best as the subsidy for it"
            " rises, at all beliefs that users can come to; if not, Whittle's index"
            " means nothing, and the Lagrangian index is used"
        ),
    ]
    divisions: Annotated[
        int | None, Field(description="of the grid of beliefs: steps from 0 to 1")
    ]
    points: Annotated[int | None, Field(description="of that grid")] = None
    reached: Annotated[
        int | None, Field(description="points around beliefs that users can come to")
    ]
    unsettled: Annotated[
        int | None,
        Field(description="those of them at which playing becomes best again"),
    ]
    unsettled_elsewhere: Annotated[
        int | None, Field(description="such points that no user comes to")
    ]
    error: Annotated[
        float | None,
        Field(
            description="how far the index of a point moved, at most, when the grid was"
            " last made finer; in rewards"
        ),
    ]
    low: Annotated[
        float | None, Field(description="up to this subsidy playing is always best")
    ]
    high: Annotated[
        float | None, Field(description="from this subsidy resting is always best")
    ]
    seconds: Annotated[float | None, Field(description="that it took to build")] = None
    catalogue: Annotated[
        int | None, Field(description="number of the catalogue from which it is in use")
    ]
    built_at: datetime | None

    @classmethod
    def of(cls, report: Report) -> Self:
        table = {name: getattr(report.table, name, None) for name in cls.model_fields}
        return cls.model_validate(
            {
                **table,
                "model": report.target.model,
                "version": report.target.version,
                "discount": report.target.discount,
                "state": report.state,
                "progress": report.progress,
            }
        )
