"""YAML as JSON is read: version 1.2's core schema, and nothing that is no JSON.

So `no`, `on`, `1:30` and `2026-11-01` are texts as they stand. A few lines of aliases
can stand for more than memory holds: so what they repeat is counted.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import yaml

TAGS = "tag:yaml.org,2002:"
Base: type = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # C's is faster
WHOLE = r"(?:0|[1-9]\d*)"
NO_NUMBER = r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
RESOLVERS = {
    "null": (r"~|null|Null|NULL|", "~nN"),
    "bool": (r"true|True|TRUE|false|False|FALSE", "tTfF"),
    "int": (rf"[-+]?{WHOLE}", "-+0123456789"),
    "float": (
        rf"[-+]?(?:\.\d+|{WHOLE}(?:\.\d*)?)(?:[eE][-+]?\d+)?|{NO_NUMBER}",
        "-+0123456789.",
    ),
}


ALLOWED = ("null", "bool", "int", "float", "str", "seq", "map")
DEEPEST = 100
LARGEST = 1_000_000  # values, those that aliases repeat included


class NotYaml(ValueError):
    """A text that is no YAML, or means more than JSON does."""


class _Core(Base):  # type: ignore[misc]  # C's or Python's
    """Reads what JSON has, too."""

    yaml_implicit_resolvers: ClassVar[dict[str, object]] = {}
    yaml_constructors: ClassVar[dict[str | None, object]] = {
        tag: constructor
        for tag, constructor in yaml.SafeLoader.yaml_constructors.items()
        if tag is None or tag.removeprefix(TAGS) in ALLOWED
    }


for _name, (_pattern, _first) in RESOLVERS.items():
    _Core.add_implicit_resolver(
        TAGS + _name, re.compile(f"(?:{_pattern})$"), [*_first, ""]
    )


def load(text: str) -> object:
    """The plain data that a text holds."""
    try:
        _check(text)
        plain: object = yaml.load(text, Loader=_Core)  # noqa: S506 - a safe loader
        _check_keys(plain)
    except yaml.MarkedYAMLError as error:
        told = f"is no YAML: {error.problem}"
        if error.problem_mark is not None:
            told += f" in line {error.problem_mark.line + 1}"
        raise NotYaml(told) from error
    except (yaml.YAMLError, ValueError) as error:
        if isinstance(error, NotYaml):
            raise
        raise NotYaml(f"is no YAML: {error}") from error
    return plain


@dataclass(slots=True)
class _Node:
    """How much a node stands for, what its aliases repeat included."""

    anchor: str | None = None
    size: int = 1
    depth: int = 1

    def hold(self, part: "_Node") -> None:
        self.size += part.size
        self.depth = max(self.depth, 1 + part.depth)


def _check(text: str) -> None:
    """Refuse what would take far more than its length to read."""
    known: dict[str, _Node] = {}
    around = [_Node()]
    for event in yaml.parse(text, Loader=_Core):
        if isinstance(event, yaml.CollectionStartEvent):
            around.append(_Node(event.anchor))
            node = None
        elif isinstance(event, yaml.CollectionEndEvent):
            node = around.pop()
        elif isinstance(event, yaml.AliasEvent):
            node = _Node(None, *_repeated(known, event.anchor))
        else:
            node = _scalar(event) if isinstance(event, yaml.ScalarEvent) else None
        if node is not None:
            around[-1].hold(node)
            if node.anchor is not None:
                known[node.anchor] = node
        if len(around) + around[-1].depth > DEEPEST:
            raise NotYaml("is nested too deeply")
        if around[-1].size > LARGEST:
            raise NotYaml(f"stands for more than {LARGEST} values")


def _scalar(event: yaml.ScalarEvent) -> _Node:
    if event.tag is not None:
        raise NotYaml(f"has the tag {event.tag}, which is not taken")
    return _Node(event.anchor)


def _repeated(known: Mapping[str, _Node], anchor: str | None) -> tuple[int, int]:
    if anchor is None or anchor not in known:
        raise NotYaml(f"has the alias *{anchor} of nothing before it")
    return known[anchor].size, known[anchor].depth


def _check_keys(plain: object) -> None:
    if isinstance(plain, dict):
        for key, value in plain.items():
            if not isinstance(key, str):
                raise NotYaml(
                    f"has the key {key!r}, which is no text: put it in quotes"
                )
            _check_keys(value)
    elif isinstance(plain, list):
        for value in plain:
            _check_keys(value)
