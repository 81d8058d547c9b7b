"""Forms of lines in files: items, models and plays, one a line."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from typing import Annotated, Self, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationError,
    model_validator,
)

from app.api.faults import message_of
from app.api.schemas.fields import Chance, Form, Id, Note, SignalName, whole
from app.api.schemas.items import ItemForm
from app.api.schemas.models import ModelForm
from app.errors import Fault
from app.services.clocks import MOST_SLOT
from app.services.entrants import NamedPolicy
from app.services.formats import Record, json_object
from app.services.histories import PastPlay
from app.services.items import NewItem
from app.services.lines import BadRecord, Layout
from app.services.new_models import NewModel

F = TypeVar("F", bound=Form)


def _moment(text: str) -> str:
    """The moment in UTC; one without a time zone is none."""
    with suppress(ValueError, OverflowError):
        moment = datetime.fromisoformat(text)
        if moment.tzinfo is not None:
            return moment.astimezone(UTC).isoformat()
    raise ValueError("must be a moment with its time zone: 2026-03-01T20:15:00Z")


Moment = Annotated[str, AfterValidator(_moment)]


class ItemLine(ItemForm):
    """An item. Inactive: retired."""

    id: Id
    active: Annotated[bool, Field(strict=True)] = True


class CatalogueLine(ItemLine):
    """An item whose model is to be found; that which it names does not matter."""

    model: Id = "unknown"


class ModelLine(ModelForm):
    """An item model."""

    id: Id


class PlayLine(Form):
    """A play that a user made before, with its answer.

    Together: in the slot of the user's play before it. Slot: if slots follow a clock.
    """

    user: Id
    item: Id
    signal: SignalName | None = None
    fraction: Annotated[Chance | None, Field(strict=True)] = None
    at: Moment | None = None
    together: Annotated[bool, Field(strict=True)] = False
    slot: Annotated[
        int | None, Field(strict=True, ge=0, le=MOST_SLOT), BeforeValidator(whole)
    ] = None

    @model_validator(mode="after")
    def _answered(self) -> Self:
        if self.signal is None and self.fraction is None:
            raise ValueError("give a signal or a fraction")
        return self


class PolicyLine(Form):
    """A policy to try, as `PUT /v1/admin/policy` takes it."""

    name: str
    params: Annotated[Mapping[str, object], Field(default_factory=dict)]
    note: Note = ""


class ImportResult(Form):
    """What an import changed, or would change in a dry run."""

    created: int
    replaced: int
    unchanged: int
    retired: int
    dry_run: bool


def read_item(record: Record) -> NewItem:
    line = _form(ItemLine, record)
    return replace(line.item(line.id), active=line.active)


def read_described(record: Record) -> NewItem:
    line = _form(CatalogueLine, record)
    return replace(line.item(line.id), active=line.active)


def read_model(record: Record) -> NewModel:
    line = _form(ModelLine, record)
    return line.model(line.id)


def read_play(record: Record) -> PastPlay:
    line = _form(PlayLine, record)
    return PastPlay(
        line.user,
        line.item,
        line.signal,
        line.fraction,
        line.at,
        line.together,
        line.slot,
    )


def read_policy(record: Record) -> NamedPolicy:
    line = _form(PolicyLine, record)
    return NamedPolicy(line.name, line.params)


def _form(kind: type[F], record: Record) -> F:
    try:
        return kind.model_validate(record)
    except ValidationError as error:
        raise BadRecord(
            *(
                Fault(
                    ".".join(map(str, problem["loc"])),
                    message_of(problem),
                    problem["input"],
                )
                for problem in error.errors(include_url=False)
            )
        ) from error


def _tags(cell: str) -> list[str]:
    return [tag for tag in cell.split(";") if tag]


def _truth(cell: str) -> bool:
    try:
        return {"true": True, "false": False}[cell.lower()]
    except KeyError:
        raise ValueError("must be true or false") from None


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ValueError("must be a number") from None


def _whole(cell: str) -> int:
    try:
        return int(cell)
    except ValueError:
        raise ValueError("must be a whole number") from None


ITEMS = Layout(
    read_item,
    {
        "id": str,
        "model": str,
        "title": str,
        "tags": _tags,
        "payload": json_object,
        "active": _truth,
    },
)
CATALOGUE = Layout(read_described, ITEMS.columns)
MODELS = Layout(read_model, {})
POLICIES = Layout(read_policy, {})
HISTORY = Layout(
    read_play,
    {
        "user": str,
        "item": str,
        "signal": str,
        "fraction": _number,
        "at": str,
        "together": _truth,
        "slot": _whole,
    },
)
