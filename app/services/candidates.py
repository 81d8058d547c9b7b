"""Models that were learned, and may go live: what `encore fit` writes, and reads."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from app.services.items import NewItem
from app.services.lines import LineFile
from app.services.model_imports import read as read_models
from app.services.new_models import NewModel

FIRST_YEAR = 1990  # a moment before counts from something else
MODELS, ITEMS, REPORT = "models.ndjson", "items.ndjson", "report.json"


class NoCandidate(Exception):
    """What is there is not what `encore fit` has written."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """Models, and which item is to follow which.

    made_at: when they were learned
    until:   they were learned from plays before that alone; None: nobody knows
    slot_s:  seconds of a slot, of models that rest by the clock
    digest:  of both files
    """

    models: Sequence[NewModel]
    items: Mapping[str, str]
    made_at: datetime
    until: datetime | None
    slot_s: float | None
    digest: str

    @property
    def judged_from(self) -> datetime:
        """From when on plays can tell whether the models are good."""
        return self.until or self.made_at


def read(
    folder: Path, models: LineFile[NewModel], items: LineFile[NewItem]
) -> Candidate:
    """A candidate from the files of a folder, if they are as they were written."""
    told = _report(folder / REPORT)
    digest = digest_of(folder)
    if told.get("digest") != digest:
        raise NoCandidate(
            f"{folder}/{MODELS} or {ITEMS} is not what {REPORT} tells of: learn anew."
        )
    faults = items.faults()
    follows = {item.id: item.model for _, item in items.entries(faults)}
    faults.refuse()
    until, slot_s = told.get("learned_until"), told.get("slot_s")
    try:
        made_at = datetime.fromisoformat(str(told["made_at"]))
        learned = None if until is None else datetime.fromisoformat(str(until))
        seconds = None if slot_s is None else float(str(slot_s))
    except (KeyError, ValueError) as error:
        raise NoCandidate(f"{folder}/{REPORT} does not tell {error}.") from error
    return Candidate(read_models(models), follows, made_at, learned, seconds, digest)


def digest_of(folder: Path) -> str:
    """What the models and items of a folder are known by."""
    found = hashlib.sha256()
    for name in (MODELS, ITEMS):
        with (folder / name).open("rb") as file:
            found.update(hashlib.file_digest(file, "sha256").digest())
    return found.hexdigest()


def moment(seconds: float | None) -> str | None:
    """A moment by seconds since 1970, None if it is none of the last decades."""
    if seconds is None:
        return None
    try:
        found = datetime.fromtimestamp(seconds, UTC)
    except (OverflowError, ValueError, OSError):
        return None
    return found.isoformat() if found.year >= FIRST_YEAR else None


def _report(file: Path) -> Mapping[str, object]:
    try:
        told = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise NoCandidate(f"{file} cannot be read: {error.strerror}.") from error
    except ValueError as error:
        raise NoCandidate(f"{file} is no JSON.") from error
    if not isinstance(told, dict):
        raise NoCandidate(f"{file} is no report of `encore fit`.")
    return told
