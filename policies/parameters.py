"""What values a policy's parameters may take, declared on its fields.

A field reads `Annotated[int, Bounds(1, 50), "what it means"]`,
`Annotated[Literal["a", "b"], "what it means"]` or, for a policy that another one
follows, `Annotated[Policy, "what it means"]`; a schema can be derived from that.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Literal, Union, get_args, get_origin, get_type_hints


@dataclass(frozen=True, slots=True)
class Bounds:
    """The range of a number, both ends included unless `below` excludes `high`."""

    low: float
    high: float
    below: bool = False

    def hold(self, value: float) -> bool:
        """Say whether `value` lies in the range; NaN never does."""
        return self.low <= value and (
            value < self.high if self.below else value <= self.high
        )

    def __str__(self) -> str:
        return f"from {self.low} to {'below ' if self.below else ''}{self.high}"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One declared field of a policy.

    Attributes:
        name: the field's name.
        kind: `int`, `float`, `bool`, `str` (a choice), or what another policy is.
        bounds: range of a number, None if it has none.
        choices: allowed strings, empty if the field is no choice.
        description: what the field means.
        several: whether a tuple of different choices is allowed, too.
    """

    name: str
    kind: type
    bounds: Bounds | None
    choices: tuple[str, ...]
    description: str
    several: bool = False

    @property
    def is_policy(self) -> bool:
        """Whether the value is another policy, with parameters of its own."""
        return self.kind not in {int, float, bool, str}


def parameters(policy: type) -> Iterator[Parameter]:
    """Yield the parameters that the class `policy` declares, in order."""
    hints = get_type_hints(policy, include_extras=True)
    for name, hint in hints.items():
        if get_origin(hint) is Annotated:
            yield _parameter(name, *get_args(hint))


def follows_another(policy: type) -> bool:
    """Say whether a parameter of the class `policy` is another policy."""
    return any(parameter.is_policy for parameter in parameters(policy))


def check(policy: object) -> None:
    """Check every parameter of `policy` against its declaration.

    A whole number in place of a fraction becomes one: compiled code is built anew for
    each kind of number that it meets.

    Raises:
        ValueError: a value has the wrong type or lies out of range; names the field.
    """
    for parameter in parameters(type(policy)):
        value: object = getattr(policy, parameter.name)
        if not _fits(parameter, value):
            raise ValueError(
                f"{parameter.name}: must be {_wanted(parameter)}, not {value!r}"
            )
        if parameter.kind is float and isinstance(value, int):
            object.__setattr__(policy, parameter.name, float(value))


def _parameter(name: str, base: object, *metadata: object) -> Parameter:
    several = get_origin(base) in {Union, UnionType}
    single = get_args(base)[0] if several else base
    choices = get_args(single) if get_origin(single) is Literal else ()
    bounds = [extra for extra in metadata if isinstance(extra, Bounds)]
    description = [extra for extra in metadata if isinstance(extra, str)]
    return Parameter(
        name=name,
        kind=base if isinstance(base, type) else str,
        bounds=bounds[0] if bounds else None,
        choices=choices,
        description=description[0] if description else "",
        several=several,
    )


def _fits(parameter: Parameter, value: object) -> bool:
    if parameter.several and isinstance(value, tuple):
        known = all(isinstance(v, str) and v in parameter.choices for v in value)
        return known and 0 < len(set(value)) == len(value)
    if parameter.is_policy:
        made = isinstance(value, parameter.kind) and not isinstance(value, type)
        return made and not follows_another(type(value))
    if parameter.choices:
        return isinstance(value, str) and value in parameter.choices
    if parameter.kind is bool or isinstance(value, bool):
        return parameter.kind is bool and isinstance(value, bool)
    if not isinstance(value, int if parameter.kind is int else int | float):
        return False
    bounds = parameter.bounds or Bounds(-math.inf, math.inf, below=True)
    return bounds.hold(value)


def _wanted(parameter: Parameter) -> str:
    if parameter.is_policy:
        return "a policy that follows no other"
    if parameter.choices:
        some = "one or several of" if parameter.several else "one of"
        return f"{some} {', '.join(parameter.choices)}"
    if parameter.kind is bool:
        return "true or false"
    number = "a whole number" if parameter.kind is int else "a number"
    return f"{number} {parameter.bounds}" if parameter.bounds else number
