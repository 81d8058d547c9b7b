"""The API's own document: OpenAPI, with every status that a call may end in."""

import json
from collections.abc import Iterator
from functools import cache
from typing import Any

from fastapi import FastAPI, Response
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute
from pydantic.json_schema import models_json_schema

from app.api import problems
from app.api.links import links_of
from app.api.schemas.problem import Problem
from app.errors import (
    BodyTooLarge,
    ClientError,
    Contended,
    DatabaseUnavailable,
    Forbidden,
    InvalidCursor,
    InvalidRequest,
    MalformedBody,
    NotReady,
    Overloaded,
    TooManyRequests,
    Unauthorized,
    UnknownOrigin,
    UnsupportedMediaType,
)

DESCRIPTION = """\
Encore chooses what to play next for people who come back to the same catalogue.

Ask for a play with `next`, show it, tell with `feedback` how it was taken, and so on:
each answer moves what is believed of the user's interest in every item.

Every call under `/v1` needs a key: **Authorize** with one of scope `serve`, or `admin`
for what administers. Errors are `application/problem+json` (RFC 9457): `code` is stable
and meant for programs, `errors` names the fields at fault.
"""
TAGS = [
    {"name": "listening", "description": "The loop: the next play, and its answer."},
    {"name": "users", "description": "What is held and believed about a user."},
    {"name": "items", "description": "The catalogue."},
    {"name": "models", "description": "How interest in an item moves and answers."},
    {"name": "policy", "description": "How the next play is chosen: swapped live."},
    {"name": "keys", "description": "Who may call."},
    {"name": "operations", "description": "For those who run the service."},
]
REF = "#/components/schemas/{model}"
METHODS = {"get", "put", "post", "delete", "patch"}
Document = dict[str, Any]


def name_of(route: APIRoute) -> str:
    """The id of an operation: the name of its function."""
    return route.name


def install(app: FastAPI) -> None:
    """Let the service tell of itself at /openapi.json."""

    @cache
    def document() -> bytes:
        return json.dumps(_document(app)).encode()

    def openapi() -> Response:  # in a thread: the first time takes a while
        return Response(document(), media_type="application/json")

    app.add_api_route("/openapi.json", openapi, include_in_schema=False)


def _document(app: FastAPI) -> Document:
    document = get_openapi(
        title=app.title,
        version=app.version,
        description=DESCRIPTION,
        tags=TAGS,
        routes=app.routes,
    )
    for operation in _operations(document):
        _complete(operation)
    _, shared = models_json_schema([(Problem, "serialization")], ref_template=REF)
    document["components"]["schemas"] |= shared["$defs"]
    _drop_unused(document)
    return document


def _complete(operation: Document) -> None:
    """Tell what the routes leave out: common errors, links, what is done in a line."""
    summary, _, rest = operation["description"].partition("\n\n")
    operation |= {"summary": summary.rstrip("."), "description": rest}
    answers = operation["responses"]
    if "HTTPValidationError" in str(answers.get("422")):
        del answers["422"]
    for error in _common(operation):
        _add(answers, error)
    if links := links_of(operation["operationId"]):
        for status in answers.keys() & {"200", "201"}:
            answers[status]["links"] = links


def _drop_unused(document: Document) -> None:
    schemas = document["components"]["schemas"]
    text = json.dumps(document)
    unused = [name for name in schemas if f'"{REF.format(model=name)}"' not in text]
    for name in unused:
        del schemas[name]
    if unused:  # what only these referred to
        _drop_unused(document)


def _operations(document: Document) -> Iterator[Document]:
    for path in document["paths"].values():
        yield from (path[method] for method in METHODS & path.keys())


def _common(operation: Document) -> Iterator[type[ClientError]]:
    """Errors that any call of this kind may meet."""
    if "security" not in operation:
        return
    yield Unauthorized
    if any(
        "admin" in scopes for way in operation["security"] for scopes in way.values()
    ):
        yield Forbidden
    yield from (UnknownOrigin, TooManyRequests, BodyTooLarge)
    if "requestBody" in operation:
        yield from (MalformedBody, UnsupportedMediaType)
    if "requestBody" in operation or "parameters" in operation:
        yield InvalidRequest
    if any(p["name"] == "cursor" for p in operation.get("parameters", ())):
        yield InvalidCursor
    yield from (DatabaseUnavailable, Overloaded, Contended, NotReady)


def _add(answers: Document, error: type[ClientError]) -> None:
    status = str(int(error.status))
    if status not in answers:
        answers[status] = problems.answer(error)
    elif f"`{error.code}`" not in answers[status]["description"]:
        answers[status]["description"] += f"\n{problems.line(error)}"
