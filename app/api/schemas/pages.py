"""Pages: how many rows, and an opaque cursor to the next ones."""

import base64
import binascii
from typing import Annotated

from fastapi import Query
from pydantic import Field

from app.errors import Fault, InvalidRequest

Limit = Annotated[int, Query(ge=1, le=1000, description="rows in a page")]
CursorQuery = Annotated[
    str | None,
    Query(max_length=1000, description="`next` of the page before"),
]
NextCursor = Annotated[
    str | None, Field(description="`cursor` of the next page, null on the last one")
]


def encode(place: str | int | None) -> str | None:
    """A cursor that stands for a place in a list."""
    if place is None:
        return None
    return base64.urlsafe_b64encode(str(place).encode()).decode().rstrip("=")


def decode(cursor: str | None, *, first: str) -> str:
    """The place that a cursor stands for; without one, the first."""
    if cursor is None:
        return first
    try:
        padded = cursor + "=" * (-len(cursor) % 4)
        place = base64.b64decode(padded, altchars=b"-_", validate=True).decode()
    except (binascii.Error, ValueError):
        raise _wrong(cursor) from None
    if not place.isprintable():
        raise _wrong(cursor)
    return place


def decode_number(cursor: str | None, *, first: int) -> int:
    """The same for a place that is a number."""
    place = decode(cursor, first=str(first))
    if not place.removeprefix("-").isdecimal() or abs(int(place)) >= 2**31:
        raise _wrong(cursor)
    return int(place)


def _wrong(cursor: str | None) -> InvalidRequest:
    fault = Fault("cursor", "not a cursor of this list", cursor)
    return InvalidRequest("The cursor was not made by this list.", fault)
