"""What becomes of things that are put, one or many."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum


class Change(IntEnum):
    CREATED = 0
    REPLACED = 1
    UNCHANGED = 2


@dataclass(frozen=True, slots=True)
class Imported:
    """How many an import changed, or would change in a dry run.

    warnings: of models, by id: what is allowed, but looks like a mistake
    """

    created: int
    replaced: int
    unchanged: int
    retired: int
    dry_run: bool
    warnings: Mapping[str, Sequence[str]] = field(default_factory=dict)
