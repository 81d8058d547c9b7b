"""Forms of publications."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated

from pydantic import Field, JsonValue

from app.api.schemas.fields import Form, Note
from app.api.schemas.pages import NextCursor


class TakeBackForm(Form):
    """Why a publication is taken back."""

    note: Note = ""


class PublicationView(Form):
    """Learned models that went live together."""

    number: int
    models: Annotated[
        Mapping[str, int], Field(description="version of each that changed, by id")
    ]
    items: Annotated[int, Field(description="how many went to another model")]
    verdict: Annotated[
        Mapping[str, JsonValue], Field(description="what the gate found")
    ]
    digest: Annotated[str, Field(description="of the candidate")]
    note: str
    at: datetime
    by: str
    undone_at: Annotated[datetime | None, Field(description="null: it stands")]
    undone_by: str | None


class PublicationPage(Form):
    """Publications, the latest first."""

    publications: list[PublicationView]
    next: NextCursor


class TakenBackView(Form):
    """A publication that was taken back."""

    publication: PublicationView
    items: Annotated[int, Field(description="that went back to their model")]
    kept: Annotated[
        Sequence[str],
        Field(description="models that were changed since, and stay as they are"),
    ]
