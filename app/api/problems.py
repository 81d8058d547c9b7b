"""Every error leaves as problem+json (RFC 9457) with a stable code."""

from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from app.api.schemas.problem import FieldProblem, Problem
from app.errors import BodyTooLarge, ClientError, Fault, InvalidRequest

MEDIA_TYPE = "application/problem+json"
LONGEST_VALUE = 200

logger = structlog.get_logger()


def install(app: FastAPI) -> None:
    app.add_exception_handler(ClientError, _client_error)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(Exception, _unexpected)


def response(error: ClientError) -> Response:
    """An error as it is answered."""
    headers = {}
    if error.retry_after is not None:
        headers["Retry-After"] = str(error.retry_after)
    if error.status is HTTPStatus.UNAUTHORIZED:
        headers["WWW-Authenticate"] = "Bearer"
    return _response(
        error.status, error.code, error.title, error.detail, error.faults, headers
    )


def responses(*errors: type[ClientError]) -> dict[int | str, dict[str, Any]]:
    """The errors of a route, for its entry in the API document."""
    by_status: dict[int, list[str]] = {}
    for error in errors:
        by_status.setdefault(int(error.status), []).append(error.code)
    return {
        status: {
            "model": Problem,
            "description": ", ".join(f"`{code}`" for code in sorted(set(codes))),
            "content": {MEDIA_TYPE: {}},
        }
        for status, codes in by_status.items()
    }


async def _client_error(_request: Request, error: Exception) -> Response:
    if not isinstance(error, ClientError):
        raise TypeError from error
    return response(error)


async def _invalid(_request: Request, error: Exception) -> Response:
    if not isinstance(error, RequestValidationError):
        raise TypeError from error
    faults = [_fault(problem) for problem in error.errors()]
    names = ", ".join(sorted({fault.field for fault in faults}))
    return response(InvalidRequest(f"Wrong: {names}.", *faults))


async def _http_error(_request: Request, error: Exception) -> Response:
    if not isinstance(error, HTTPException):
        raise TypeError from error
    status = HTTPStatus(error.status_code)
    if status is HTTPStatus.REQUEST_ENTITY_TOO_LARGE:
        return response(BodyTooLarge(str(error.detail)))
    code = "malformed_body" if status is HTTPStatus.BAD_REQUEST else _code(status)
    return _response(
        status, code, status.phrase, str(error.detail), (), error.headers or {}
    )


async def _unexpected(request: Request, error: Exception) -> Response:
    logger.error("unexpected error", path=request.url.path, exc_info=error)
    return _response(
        HTTPStatus.INTERNAL_SERVER_ERROR,
        "internal_error",
        "Something went wrong in the service",
        "It was logged under the id of this request.",
        (),
        {},
    )


def _response(  # noqa: PLR0913, PLR0917 - the members of a problem
    status: HTTPStatus,
    code: str,
    title: str,
    detail: str,
    faults: Sequence[Fault],
    headers: Mapping[str, str],
) -> Response:
    problem = Problem(
        type=f"urn:encore:problem:{code}",
        title=title,
        status=status,
        code=code,
        detail=detail,
        errors=[
            FieldProblem(
                field=fault.field, message=fault.message, value=_shown(fault.value)
            )
            for fault in faults
        ],
    )
    return Response(
        problem.model_dump_json(), status, headers=headers, media_type=MEDIA_TYPE
    )


def _code(status: HTTPStatus) -> str:
    return status.phrase.lower().replace(" ", "_").replace("-", "_")


def _fault(problem: Mapping[str, Any]) -> Fault:
    place = [str(part) for part in problem["loc"] if part not in {"body", "query"}]
    place = place[1:] if place[:1] in (["path"], ["header"]) else place
    return Fault(".".join(place) or "body", problem["msg"], problem.get("input"))


def _shown(value: object) -> object:
    """A value at fault, in a form that is short and always JSON."""
    if value is None or isinstance(value, bool | int):
        return value if not isinstance(value, int) or abs(value) < 2**53 else str(value)
    text = str(value).encode("utf-8", "backslashreplace").decode()
    return text if len(text) <= LONGEST_VALUE else text[:LONGEST_VALUE] + "…"
