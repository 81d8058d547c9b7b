"""Ids of plays tell when they were chosen: version 7 begins with milliseconds."""

from datetime import UTC, datetime
from uuid import UUID


def since(moment: datetime) -> UUID:
    """An id before those of all plays from that moment on."""
    return UUID(int=int(moment.timestamp() * 1000) << 80)


def moment(play: UUID) -> datetime:
    """When a play was chosen."""
    return datetime.fromtimestamp((play.int >> 80) / 1000, tz=UTC)
