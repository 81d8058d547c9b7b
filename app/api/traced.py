"""Some requests are traced: spans of what they did, as part of their caller's trace."""

import structlog
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.api.middleware import route_of
from app.tracing import Parent, Tracer, parent_of


class Traced:
    """Traces those requests that a tracer chooses; there is none where none is set."""

    def __init__(self, app: ASGIApp, *, tracer: Tracer) -> None:
        self.app = app
        self.tracer = tracer

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        parent = _parent(scope)
        if self.tracer.samples(parent):
            await self._trace(parent, scope, receive, send)
            return
        if parent is not None:
            structlog.contextvars.bind_contextvars(trace_id=f"{parent.trace:032x}")
        await self.app(scope, receive, send)

    async def _trace(
        self, parent: Parent | None, scope: Scope, receive: Receive, send: Send
    ) -> None:
        status = 500  # until another is sent

        async def send_noting(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        request = self.tracer.begin(parent)
        structlog.contextvars.bind_contextvars(trace_id=request.trace)
        try:
            await self.app(scope, receive, send_noting)
        finally:
            method, route = scope["method"], route_of(scope)
            request.end(
                f"{method} {route}",
                status,
                {
                    "http.request.method": method,
                    "http.route": route,
                    "http.response.status_code": status,
                    "encore.request_id": _request_id(),
                },
            )


def _parent(scope: Scope) -> Parent | None:
    sent = Headers(scope=scope).getlist("traceparent")
    return parent_of(sent[0]) if len(sent) == 1 else None


def _request_id() -> str:
    return str(structlog.contextvars.get_contextvars()["request_id"])
