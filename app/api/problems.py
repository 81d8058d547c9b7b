"""Every error leaves as problem+json (RFC 9457) with a stable code."""

import re
from collections.abc import Iterable, Mapping
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException

from app import metrics
from app.api.faults import clean, fault_of, short, shown
from app.api.schemas.problem import Problem
from app.errors import (
    BodyTooLarge,
    ClientError,
    InvalidRequest,
    MalformedBody,
    UnsupportedMediaType,
)

DETAILS = {
    HTTPStatus.NOT_FOUND: "There is no such path; /docs shows those that there are.",
    HTTPStatus.METHOD_NOT_ALLOWED: "This path takes only the methods in Allow.",
}
MEDIA_TYPE = "application/problem+json"
SCHEMA = {"$ref": "#/components/schemas/Problem"}
MOST_FAULTS = 100

logger = structlog.get_logger()


def install(app: FastAPI, routers: Iterable[APIRouter]) -> None:
    methods: dict[str, set[str]] = {}
    for router in routers:
        for route in router.routes:
            if isinstance(route, APIRoute):
                methods.setdefault(route.path_format, set()).update(route.methods or ())

    async def http_error(request: Request, error: Exception) -> Response:
        path = getattr(request.scope.get("route"), "path_format", "")
        return _http_error(error, methods.get(path, ()))

    app.add_exception_handler(ClientError, _client_error)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, http_error)


def response(error: ClientError) -> Response:
    """An error as it is answered."""
    headers = {}
    if error.retry_after is not None:
        headers["Retry-After"] = str(error.retry_after)
    if error.status is HTTPStatus.UNAUTHORIZED:
        headers["WWW-Authenticate"] = "Bearer"
    problem = _problem(error.status, error.code, error.title, error.detail)
    problem.errors = [shown(fault) for fault in error.faults[:MOST_FAULTS]]
    return _response(problem, headers)


def unexpected(error: Exception) -> Response:
    """The answer where the service itself is at fault, which is logged."""
    logger.error("unexpected error", exc_info=error)
    return _response(
        _problem(
            HTTPStatus.INTERNAL_SERVER_ERROR,
            "internal_error",
            "Something went wrong in the service",
            "It was logged under the id of this request, see X-Request-ID.",
        )
    )


def responses(*errors: type[ClientError]) -> dict[int | str, dict[str, Any]]:
    """The errors of a route, for its entry in the API document."""
    by_status: dict[int | str, list[type[ClientError]]] = {}
    for error in errors:
        by_status.setdefault(int(error.status), []).append(error)
    return {status: answer(*alike) for status, alike in by_status.items()}


def answer(*errors: type[ClientError]) -> dict[str, Any]:
    """Errors of one status, for the API document."""
    return {
        "description": "\n".join(line(error) for error in errors),
        "content": {MEDIA_TYPE: {"schema": SCHEMA, "example": _example(errors[0])}},
    }


def line(error: type[ClientError]) -> str:
    """An error in one line of Markdown."""
    return f"- `{error.code}`: {error.title}"


def _example(error: type[ClientError]) -> dict[str, object]:
    problem = _problem(error.status, error.code, error.title, "…")
    return problem.model_dump(mode="json")


async def _client_error(_request: Request, error: Exception) -> Response:
    if not isinstance(error, ClientError):
        raise TypeError from error
    return response(error)


async def _invalid(_request: Request, error: Exception) -> Response:
    if not isinstance(error, RequestValidationError):
        raise TypeError from error
    problems = error.errors()
    if isinstance(error.body, bytes) and any(p["loc"] == ("body",) for p in problems):
        return response(UnsupportedMediaType("Send the body as application/json."))
    if problems[0]["type"] == "json_invalid":
        place, reason = problems[0]["loc"][1], problems[0]["ctx"]["error"]
        return response(MalformedBody(f"At character {place}: {reason}."))
    faults = [fault_of(problem) for problem in problems]
    names = sorted({fault.field for fault in faults})
    return response(InvalidRequest(f"Wrong: {short(', '.join(names))}.", *faults))


def _http_error(error: Exception, methods: Iterable[str]) -> Response:
    if not isinstance(error, HTTPException):
        raise TypeError from error
    status = HTTPStatus(error.status_code)
    if status is HTTPStatus.REQUEST_ENTITY_TOO_LARGE:
        return response(BodyTooLarge(str(error.detail)))
    if status is HTTPStatus.BAD_REQUEST:
        return response(MalformedBody("It is no JSON in UTF-8, or nested too deeply."))
    headers = dict(error.headers or {})
    if status is HTTPStatus.METHOD_NOT_ALLOWED and methods:
        headers["Allow"] = ", ".join(sorted(methods))
    code = re.sub(r"\W", "_", status.phrase.lower())
    detail = DETAILS.get(status, str(error.detail))
    problem = _problem(status, code, status.phrase, detail)
    return _response(problem, headers)


def _problem(status: HTTPStatus, code: str, title: str, detail: str) -> Problem:
    return Problem(
        type=f"urn:encore:problem:{code}",
        title=title,
        status=status,
        code=code,
        detail=clean(detail),
    )


def _response(problem: Problem, headers: Mapping[str, str] | None = None) -> Response:
    metrics.errors(problem.code).inc()
    return Response(
        problem.model_dump_json(),
        problem.status,
        headers=headers,
        media_type=MEDIA_TYPE,
    )
