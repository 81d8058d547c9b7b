"""Fields that many forms share."""

from typing import Annotated
from urllib.parse import unquote

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
)


class Form(BaseModel):
    """A request or an answer; what it does not know, it refuses."""

    model_config = ConfigDict(extra="forbid", frozen=True, from_attributes=True)


def _visible(text: str) -> str:
    if not text.isprintable() or any(character.isspace() for character in text):
        raise ValueError("must consist of visible characters")
    if text in {".", ".."}:
        raise ValueError("must not be a relative path")
    return text


def _storable(text: str) -> str:
    if "\x00" in text:
        raise ValueError("must not hold the character NUL")
    return text


def _decoded(raw: object) -> object:
    """Decode a path segment, which arrives as it was sent."""
    return unquote(raw, errors="strict") if isinstance(raw, str) else raw


Id = Annotated[
    str,
    StringConstraints(min_length=1, max_length=128),
    AfterValidator(_visible),
    Field(description="1 to 128 visible characters of any script"),
]
PathId = Annotated[Id, BeforeValidator(_decoded)]
Note = Annotated[
    str,
    StringConstraints(strict=True, max_length=1000),
    AfterValidator(_storable),
    Field(description="why, for those who read the history"),
]
Chance = Annotated[float, Field(ge=0, le=1)]
