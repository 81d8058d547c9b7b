"""Forms of item models."""

import re
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Self

from pydantic import AfterValidator, Field, StringConstraints

from app.api.schemas.fields import WORDS, Form, Note, storable
from app.api.schemas.pages import NextCursor
from app.domain import ItemModel
from app.services.models import NewModel

MOST_STATES = 64
NAME = re.compile(WORDS)


def _named(text: str) -> str:
    if not NAME.fullmatch(text):
        raise ValueError("must be words of visible characters")
    return storable(text)


StateName = Annotated[
    str,
    StringConstraints(strict=True, min_length=1, max_length=64),
    AfterValidator(_named),
    Field(json_schema_extra={"pattern": WORDS}),
]
Probability = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=0, le=1 + 1e-6)
]
Vector = Annotated[list[Probability], Field(min_length=2, max_length=MOST_STATES)]
Matrix = Annotated[list[Vector], Field(min_length=2, max_length=MOST_STATES)]


class ModelForm(Form):
    """How interest in an item moves, state to state, and how it is answered."""

    states: Annotated[
        list[StateName],
        Field(
            min_length=2,
            max_length=MOST_STATES,
            description="names of the hidden states of interest",
            examples=[["low", "high"]],
        ),
    ]
    play: Annotated[
        Matrix,
        Field(
            description="row i: where state i moves when the item is played",
            examples=[[[0.9, 0.1], [0.4, 0.6]]],
        ),
    ]
    rest: Annotated[
        Matrix,
        Field(
            description="row i: where state i moves when another item is played",
            examples=[[[0.7, 0.3], [0.1, 0.9]]],
        ),
    ]
    like: Annotated[
        Vector, Field(description="chance of a like, by state", examples=[[0.2, 0.9]])
    ]
    prior: Annotated[
        Vector, Field(description="belief about a new user", examples=[[0.5, 0.5]])
    ]
    source: Annotated[Note, Field(description="where these numbers come from")] = ""

    def model(self, model_id: str) -> NewModel:
        return NewModel(
            model_id,
            self.states,
            self.play,
            self.rest,
            self.like,
            self.prior,
            self.source,
        )


class ModelView(Form):
    """One version of a model."""

    id: str
    version: int
    states: Sequence[str]
    play: Sequence[Sequence[float]]
    rest: Sequence[Sequence[float]]
    like: Sequence[float]
    prior: Sequence[float]
    source: str
    created_at: datetime
    warnings: Annotated[
        Sequence[str], Field(description="allowed, but looks like a mistake")
    ]

    @classmethod
    def of(cls, model: ItemModel, warnings: Sequence[str]) -> Self:
        return cls(
            id=model.id,
            version=model.version,
            states=model.states,
            play=model.play,
            rest=model.rest,
            like=model.like,
            prior=model.prior,
            source=model.source,
            created_at=model.created_at,
            warnings=warnings,
        )


class ModelPage(Form):
    """Models in order of id, each in its latest version."""

    models: list[ModelView]
    next: NextCursor
