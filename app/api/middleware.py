"""What happens to every request before it is routed; plain ASGI, for speed."""

import re
import time
from urllib.parse import unquote
from uuid import uuid4

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app import metrics
from app.api import problems
from app.errors import BodyTooLarge

REQUEST_ID = re.compile(r"[!-~]{1,128}")
LENGTH = re.compile(r"[0-9]{1,18}")
LOGGED = ("user", "play")
API = "/v1/"
IMPORT = "/v1/items/import"

logger = structlog.get_logger()


class PathsAsSent:
    """Routes a path as it was sent, so that an id may hold any character.

    Decoded first, the slash inside an id would be taken for the end of a segment. Path
    parameters decode themselves (`app.api.schemas.fields.PathId`).
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope.get("raw_path"):
            raw = scope["raw_path"].partition(b"?")[0].decode("latin-1")
            scope = {**scope, "path": raw}
        await self.app(scope, receive, send)


class Observed:
    """Gives each request an id, an answer, a log line and a place in the metrics."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        began = time.perf_counter()
        request_id = _request_id(scope)
        status = 0

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers["X-Request-ID"] = request_id
                if scope["path"].startswith(API):
                    headers["Cache-Control"] = "no-store"
            await send(message)

        structlog.contextvars.clear_contextvars()
        structlog.contextvars.bind_contextvars(request_id=request_id)
        try:
            await self.app(scope, receive, send_with_id)
        except Exception as error:
            answer = problems.unexpected(error)
            if status:
                raise
            await answer(scope, receive, send_with_id)
        finally:
            _observe(scope, status or 500, time.perf_counter() - began)


class BodyLimit:
    """Refuses bodies that are too large, before or while they are read."""

    def __init__(self, app: ASGIApp, *, limit: int, import_limit: int) -> None:
        self.app = app
        self.limit = limit
        self.import_limit = import_limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        limit = self.import_limit if scope["path"] == IMPORT else self.limit
        detail = f"At most {limit} bytes are taken here."
        declared = Headers(scope=scope).get("content-length", "0")
        if not LENGTH.fullmatch(declared) or int(declared) > limit:
            refusal = problems.response(BodyTooLarge(detail))
            await refusal(scope, receive, send)
            return
        read = 0

        async def receive_limited() -> Message:
            nonlocal read
            message = await receive()
            read += len(message.get("body", b""))
            if read > limit:
                raise HTTPException(413, detail)
            return message

        await self.app(scope, receive_limited, send)


def _request_id(scope: Scope) -> str:
    sent = Headers(scope=scope).get("x-request-id", "")
    return sent if REQUEST_ID.fullmatch(sent) else uuid4().hex


def _observe(scope: Scope, status: int, took: float) -> None:
    route = route_of(scope)
    metrics.requests(scope["method"], route, status).observe(took)
    named = {
        name: unquote(str(value))[:128]
        for name, value in scope.get("path_params", {}).items()
        if name in LOGGED
    }
    structlog.contextvars.bind_contextvars(
        **(named | structlog.contextvars.get_contextvars())
    )
    logger.info(
        "request",
        method=scope["method"],
        route=route,
        status=status,
        ms=round(took * 1000, 3),
    )


def route_of(scope: Scope) -> str:
    """The template of a path, or what it is mounted on; few, whatever clients send."""
    mounted = scope.get("root_path", "").removeprefix(scope.get("app_root_path", ""))
    return getattr(scope.get("route"), "path_format", mounted or "unmatched")
