"""What becomes of things that are put, one or many."""

from dataclasses import dataclass
from enum import IntEnum


class Change(IntEnum):
    CREATED = 0
    REPLACED = 1
    UNCHANGED = 2


@dataclass(frozen=True, slots=True)
class Imported:
    """How many an import changed, or would change in a dry run."""

    created: int
    replaced: int
    unchanged: int
    retired: int
    dry_run: bool
