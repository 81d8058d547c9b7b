"""Fields that many forms share."""

import re
from typing import Annotated
from urllib.parse import unquote

from fastapi import Query
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


# Control, space and format characters. Listed, not asked of Python's Unicode tables:
# the document says the same in a pattern, and what is assigned changes by version.
UNSEEN = (
    r"\u0000-\u0020\u007f-\u00a0\u00ad\u061c\u1680\u180e\u2000-\u200f"
    r"\u2028-\u202f\u205f-\u206f\u3000\ufeff\ufff9-\ufffb"
)
ID = rf"^(\.{{0,2}}[^.{UNSEEN}][^{UNSEEN}]*|\.{{3}}[^{UNSEEN}]*)$"
SIGNAL = rf"^[^{UNSEEN}]+$"
WORDS = rf"^[^{UNSEEN}]+( [^{UNSEEN}]+)*$"
VISIBLE = re.compile(ID)
TOLD = re.compile(SIGNAL)
NO_NUL = r"^[^\u0000]*$"


def storable(text: str) -> str:
    """Text that every database takes: no NUL, no half of a surrogate pair."""
    if "\x00" in text:
        raise ValueError("must not hold the character NUL")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError("must be valid Unicode") from None
    return text


def whole(sent: object) -> object:
    """JSON tells no integers from other numbers: 3.0 is 3."""
    return int(sent) if isinstance(sent, float) and sent.is_integer() else sent


def _visible(text: str) -> str:
    if text in {".", ".."}:
        raise ValueError("must not be a relative path")
    if not VISIBLE.fullmatch(text):
        raise ValueError("must consist of visible characters")
    return storable(text)


def _told(text: str) -> str:
    if not TOLD.fullmatch(text):
        raise ValueError("must consist of visible characters")
    return storable(text)


def _decoded(raw: object) -> object:
    """Decode a path segment, which arrives as it was sent."""
    return unquote(raw, errors="strict") if isinstance(raw, str) else raw


Id = Annotated[
    str,
    StringConstraints(min_length=1, max_length=128),
    AfterValidator(_visible),
    Field(
        description="1 to 128 visible characters of any script",
        examples=["ann"],
        json_schema_extra={"pattern": ID},
    ),
]
SignalName = Annotated[
    str,
    StringConstraints(strict=True, min_length=1, max_length=64),
    AfterValidator(_told),
    Field(json_schema_extra={"pattern": SIGNAL}),
]
PathId = Annotated[Id, BeforeValidator(_decoded)]
Names = Annotated[list[Id], Query(max_length=100)]
NO_NAMES: list[str] = []  # a default_factory is inspected anew for each request
Note = Annotated[
    str,
    StringConstraints(strict=True, max_length=1000),
    AfterValidator(storable),
    Field(
        description="why, for those who read the history",
        json_schema_extra={"pattern": NO_NUL},
    ),
]
Chance = Annotated[float, Field(ge=0, le=1)]
Reward = Annotated[
    float,
    Field(
        ge=0,
        le=1,
        description="expected reward of a play: the chance of a like where signals"
        " are skip and like",
    ),
]
