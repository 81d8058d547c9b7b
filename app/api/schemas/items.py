"""Forms of items."""

import json
import math
import unicodedata
from collections.abc import Mapping
from datetime import datetime
from typing import Annotated

from pydantic import AfterValidator, Field, StringConstraints

from app.api.schemas.fields import Form, Id
from app.api.schemas.pages import NextCursor
from app.services.items import NewItem

DEEPEST = 32
LARGEST = 16_384


def _unambiguous(tags: list[str]) -> list[str]:
    if len(set(tags)) < len(tags):
        raise ValueError("must not name a tag twice")
    return tags


def _readable(text: str) -> str:
    if any(unicodedata.category(character) in {"Cc", "Cs"} for character in text):
        raise ValueError("must not hold control characters")
    return text


def _storable(payload: dict[str, object]) -> dict[str, object]:
    _check(payload, DEEPEST)
    size = len(json.dumps(payload, ensure_ascii=False).encode())
    if size > LARGEST:
        raise ValueError(f"must be at most {LARGEST} bytes as JSON, not {size}")
    return payload


def _check(value: object, depth: int) -> None:
    """Refuse what a database cannot keep, or an answer cannot carry, as JSON."""
    match value:
        case str():
            if "\x00" in value or (not value.isascii() and _broken(value)):
                raise ValueError("must not hold NUL or half a surrogate pair")
        case float():
            if not math.isfinite(value):
                raise ValueError("must not hold NaN or Infinity")
        case dict() | list():
            if depth == 0:
                raise ValueError(f"must not be nested deeper than {DEEPEST} levels")
            for part in (*value, *value.values()) if isinstance(value, dict) else value:
                _check(part, depth - 1)


def _broken(text: str) -> bool:
    return any(0xD800 <= ord(character) <= 0xDFFF for character in text)  # noqa: PLR2004


Title = Annotated[
    str,
    StringConstraints(strict=True, max_length=500),
    AfterValidator(_readable),
    Field(
        description="shown to the listener",
        examples=["Night Drive"],
        json_schema_extra={"pattern": r"^[^\u0000-\u001f\u007f-\u009f]*$"},
    ),
]
Tags = Annotated[
    list[Id],
    Field(max_length=64, examples=[["calm"]], json_schema_extra={"uniqueItems": True}),
    AfterValidator(_unambiguous),
]
Payload = Annotated[
    dict[str, object],
    AfterValidator(_storable),
    Field(
        description="handed to the client with each play; at most 16 kB as JSON",
        examples=[{"url": "https://example.com/night-drive.mp3"}],
    ),
]


class ItemForm(Form):
    """An item to create or replace."""

    model: Annotated[Id, Field(examples=["pop"])]
    title: Title = ""
    tags: Annotated[Tags, Field(default_factory=list)]
    payload: Annotated[Payload, Field(default_factory=dict)]

    def item(self, item_id: str) -> NewItem:
        return NewItem(item_id, self.model, self.title, self.tags, self.payload)


class ItemView(Form):
    """An item as it is kept. Inactive: retired, not recommended any more."""

    id: str
    model: str
    title: str
    tags: list[str]
    payload: Mapping[str, object]
    active: bool
    created_at: datetime
    updated_at: datetime


class ItemPage(Form):
    """Items in order of id."""

    items: list[ItemView]
    next: NextCursor
