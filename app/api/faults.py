"""Fields at fault, in words and values that may be shown."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from app.api.schemas.problem import FieldProblem
from app.errors import Fault

LONGEST = 200
SECRET = re.compile(r"encore_[\w-]{8,}")
PREFIXES = ("Value error, ", "Assertion failed, ")
MESSAGES = {
    "missing": "is needed",
    "extra_forbidden": "is not known here",
    "dict_type": "must be an object",
    "model_type": "must be an object",
    "model_attributes_type": "must be an object",
    "string_unicode": "must be valid Unicode",
    "invalid_key": "names of fields must be valid Unicode",
}


def fault_of(problem: Mapping[str, Any]) -> Fault:
    """A fault that Pydantic found."""
    place: Sequence[object] = problem["loc"]
    field = ".".join(map(str, place[1:])) or str(place[0])
    return Fault(field, message_of(problem), problem.get("input"))


def message_of(problem: Mapping[str, Any]) -> str:
    """What is wrong with a field, in our words."""
    message: str = MESSAGES.get(problem["type"], problem["msg"])
    for prefix in PREFIXES:
        message = message.removeprefix(prefix)
    return message


def shown(fault: Fault) -> FieldProblem:
    """A fault as it is answered."""
    return FieldProblem(
        field=short(fault.field),
        message=short(fault.message),
        value=_value(fault.value),
    )


def short(text: str) -> str:
    text = clean(text[: LONGEST + 1])
    return text if len(text) <= LONGEST else text[:LONGEST] + "…"


def clean(text: str) -> str:
    """Text that JSON can carry and that gives no secret away."""
    text = text.encode("utf-8", "backslashreplace").decode()
    return SECRET.sub("encore_…", text)


def _value(value: object) -> str | int | float | bool | None:
    """A value at fault, in a form that is short and always JSON."""
    if isinstance(value, dict | list | tuple):
        return None
    if value is None or (isinstance(value, int) and abs(value) < 2**53):
        return value
    if isinstance(value, float) and math.isfinite(value):
        return value
    return short("a very long number" if isinstance(value, int) else str(value))
