"""The straight way for the two calls of a listener, where nothing in them is unusual.

A web framework asks of each request what it might be: which of eighty routes, which of
its parameters are lists, what must be closed behind it. For these calls that costs more
than to read, decide and write. So a plain request, without filters and with nothing
wrong in it, is handed to the function that its route would call, behind the same guard.
All others go the long way, which also says what is wrong (docs/adr/0021).
"""

import json
from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from typing import NamedTuple
from uuid import UUID

from fastapi import Request
from fastapi.routing import APIRoute
from pydantic import BaseModel, TypeAdapter, ValidationError
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.api import listening, problems
from app.api.context import Caller
from app.api.schemas.fields import PathId
from app.api.schemas.listening import FeedbackForm
from app.errors import ClientError

USER: TypeAdapter[str] = TypeAdapter(PathId)
PLAY: TypeAdapter[UUID] = TypeAdapter(UUID)
FORM: TypeAdapter[FeedbackForm] = TypeAdapter(FeedbackForm)
THEN = {b"": False, b"next=true": True}
JSON = "application/json"
LONGEST = 10_000  # bytes of a form that is read here


class Plain(NamedTuple):
    """A call that its route would make."""

    route: APIRoute
    names: Mapping[str, str]
    call: Callable[[Caller], Awaitable[BaseModel]]


class Straight:
    """Answers plain requests, hands all others on."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._next = _route(listening.next_play)
        self._feedback = _route(listening.give_feedback)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        plain = None
        if scope["type"] == "http" and scope["method"] == "GET":
            plain = self._asked(scope)
        elif scope["type"] == "http" and scope["method"] == "POST":
            plain, receive = await self._answered(scope, receive)
        if plain is None:
            await self.app(scope, receive, send)
        else:
            await _serve(plain, scope, receive, send)

    def _asked(self, scope: Scope) -> Plain | None:
        found = self._next.path_regex.match(scope["path"])
        if found is None or scope["query_string"]:
            return None
        try:
            user = USER.validate_python(found["user"])
        except ValidationError:
            return None
        call = partial(listening.next_play, user=user)
        return Plain(self._next, found.groupdict(), call)

    async def _answered(
        self, scope: Scope, receive: Receive
    ) -> tuple[Plain | None, Receive]:
        """The call if it is plain, and the body for whoever reads it now."""
        found = self._feedback.path_regex.match(scope["path"])
        then = THEN.get(scope["query_string"])
        if found is None or then is None or not _is_short_json(scope):
            return None, receive
        message = await receive()
        try:
            play = PLAY.validate_python(found["play"])
            form = FORM.validate_python(_read(message))
        except (ValueError, RecursionError):  # a ValidationError is a ValueError
            return None, _again(message, receive)
        call = partial(listening.give_feedback, play=play, form=form, next=then)
        return Plain(self._feedback, found.groupdict(), call), receive


def _route(endpoint: Callable[..., object]) -> APIRoute:
    return next(
        route
        for route in listening.router.routes
        if isinstance(route, APIRoute) and route.endpoint is endpoint
    )


def _is_short_json(scope: Scope) -> bool:
    headers = Headers(scope=scope)
    kind = headers.get("content-type", "").partition(";")[0]
    length = headers.get("content-length", "")
    return kind == JSON and length.isdecimal() and int(length) <= LONGEST


def _read(message: Message) -> object:
    if message.get("more_body"):
        raise ValueError("there is more to come")
    return json.loads(message.get("body", b""))


def _again(message: Message, receive: Receive) -> Receive:
    """Receive a message that was received before, then what follows."""
    first = [message]

    async def again() -> Message:
        return first.pop() if first else await receive()

    return again


async def _serve(plain: Plain, scope: Scope, receive: Receive, send: Send) -> None:
    scope["route"], scope["path_params"] = plain.route, plain.names
    (guard,) = plain.route.dependant.dependencies
    try:
        if guard.call is None:
            raise TypeError(guard)
        caller = await guard.call(Request(scope, receive))
        answer = await plain.call(caller)
    except ClientError as error:
        await problems.response(error)(scope, receive, send)
        return
    body = answer.model_dump_json().encode()
    length = str(len(body)).encode()
    headers = [(b"content-length", length), (b"content-type", JSON.encode())]
    await send({"type": "http.response.start", "status": 200, "headers": headers})
    await send({"type": "http.response.body", "body": body})
