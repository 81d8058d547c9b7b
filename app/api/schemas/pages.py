"""Pages: how many entries, and where the page before ended, in a form only we read."""

import base64
import binascii
import json
from contextlib import suppress
from typing import Annotated, TypeGuard

from fastapi import Query
from pydantic import Field

from app.api.schemas.fields import storable
from app.errors import InvalidCursor

LONGEST = 128
HIGHEST = 2**31 - 1

Limit = Annotated[int, Query(ge=1, le=1000, description="most entries of a page")]
CursorQuery = Annotated[
    str | None, Query(max_length=1000, description="`next` of the page before")
]
NextCursor = Annotated[
    str | None, Field(description="cursor of the page that follows, null at the end")
]


def encode(place: str | int | tuple[int, int] | None) -> str | None:
    """The cursor of the page that follows this place, if one does."""
    if place is None:
        return None
    plain = json.dumps(place).encode()
    return base64.urlsafe_b64encode(plain).decode().rstrip("=")


def decode_text(cursor: str | None, first: str = "") -> str:
    """The place, an id, that a cursor stands for."""
    if cursor is None:
        return first
    place = _read(cursor)
    if isinstance(place, str) and len(place) <= LONGEST:
        with suppress(ValueError):
            return storable(place)
    raise InvalidCursor(cursor)


def decode_number(cursor: str | None, first: int) -> int:
    """The place, a number, that a cursor stands for."""
    if cursor is None:
        return first
    place = _read(cursor)
    if _is_number(place):
        return place
    raise InvalidCursor(cursor)


def decode_pair(cursor: str | None, first: tuple[int, int]) -> tuple[int, int]:
    """The place, two numbers, that a cursor stands for."""
    if cursor is None:
        return first
    match _read(cursor):
        case [major, minor] if _is_number(major) and _is_number(minor):
            return major, minor
    raise InvalidCursor(cursor)


def _is_number(place: object) -> TypeGuard[int]:
    return type(place) is int and 0 <= place <= HIGHEST


def _read(cursor: str) -> object:
    padding = "=" * (-len(cursor) % 4)
    try:
        plain = base64.b64decode(cursor + padding, altchars=b"-_", validate=True)
        place: object = json.loads(plain)
    except (ValueError, binascii.Error, RecursionError) as error:
        raise InvalidCursor(cursor) from error
    return place
