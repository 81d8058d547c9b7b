"""What a request remembers of what it did, if it is traced; few are.

The request that runs may have a recorder; what it passes through tells that what it
did. `app.telemetry` makes recorders; where nothing is traced, nothing of it is loaded.
"""

import re
from collections.abc import Awaitable, Callable, Mapping
from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from time import perf_counter
from typing import ParamSpec, Protocol, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

# W3C Trace Context: version, trace, parent, flags; later versions may add to these
TRACEPARENT = re.compile(
    r"([0-9a-f]{2})-([0-9a-f]{32})-([0-9a-f]{16})-([0-9a-f]{2})(-.*)?"
)
SAMPLED = 1


@dataclass(frozen=True, slots=True)
class Parent:
    """The span of a caller, of which a request is part."""

    trace: int
    span: int
    sampled: bool


class Recorder(Protocol):
    """Keeps what one request did, and when by `perf_counter`."""

    def note(
        self, name: str, began: float, ended: float, attributes: Mapping[str, str]
    ) -> None:
        """Remember something that is over."""

    def within(self, name: str) -> AbstractContextManager[None]:
        """Remember what begins, and as part of it what is done until it ends."""


class Request(Protocol):
    """A request that is traced."""

    @property
    def trace(self) -> str:
        """The id of its trace."""

    def end(self, name: str, status: int, attributes: Mapping[str, str | int]) -> None:
        """Tell what it was and how it ended."""


class Tracer(Protocol):
    """Chooses which requests are traced, and sends off what they remember."""

    def samples(self, parent: Parent | None) -> bool: ...

    def begin(self, parent: Parent | None) -> Request:
        """Trace the request that runs."""

    def close(self) -> None:
        """Send what was not sent yet; may take a while."""


current: ContextVar[Recorder | None] = ContextVar("recorder", default=None)


def parent_of(header: str) -> Parent | None:
    """What a `traceparent` says; None if it says nothing that can be understood."""
    found = TRACEPARENT.fullmatch(header)
    if found is None:
        return None
    version, trace, span, flags, more = found.groups()
    parent = Parent(int(trace, 16), int(span, 16), bool(int(flags, 16) & SAMPLED))
    unknown = version == "ff" or (version == "00" and more is not None)
    return None if unknown or not (parent.trace and parent.span) else parent


def note(name: str, began: float, **attributes: str) -> None:
    """Remember what began then and is over now, if the request is traced."""
    recorder = current.get()
    if recorder is not None:
        recorder.note(name, began, perf_counter(), attributes)


def noted(name: str, function: Callable[P, Awaitable[T]]) -> Callable[P, Awaitable[T]]:
    """A function whose calls are remembered."""

    @wraps(function)
    async def call(*args: P.args, **kwargs: P.kwargs) -> T:
        began = perf_counter()
        try:
            return await function(*args, **kwargs)
        finally:
            note(name, began)

    return call
