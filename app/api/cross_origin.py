"""Scripts of other origins' pages may call with keys that are for them (CORS).

A browser asks first whether it may, and tells no key then: it may if any key is for
pages of its origin. The call itself is answered with leave to read only if its own key
is.
"""

from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.services.keys import KeyRing

API = "/v1/"
METHODS = "DELETE, GET, POST, PUT"
HEADERS = "Authorization, Content-Type, Idempotency-Key, X-Request-ID"
READABLE = "Retry-After, X-Request-ID"
FOR_SECONDS = "600"


class CrossOrigin:
    """Answers what browsers ask first, and gives leave to read answers."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        origin = _origin(scope)
        if origin is None:
            await self.app(scope, receive, send)
            return
        if scope["method"] == "OPTIONS":
            keyring: KeyRing = scope["app"].state.context.keyring
            known = await keyring.knows_origin(origin)
            await _preflight(origin if known else None)(scope, receive, send)
            return

        async def send_with_leave(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.add_vary_header("Origin")
                if scope.get("encore.origin") == origin:
                    headers["Access-Control-Allow-Origin"] = origin
                    headers["Access-Control-Expose-Headers"] = READABLE
            await send(message)

        await self.app(scope, receive, send_with_leave)


def _origin(scope: Scope) -> str | None:
    """That of a call of the API by a script."""
    if scope["type"] != "http" or not scope["path"].startswith(API):
        return None
    headers = Headers(scope=scope)
    asks = scope["method"] != "OPTIONS" or "access-control-request-method" in headers
    return headers.get("origin") if asks else None


def _preflight(origin: str | None) -> Response:
    """Leave to call, or without an origin none."""
    leave = {"Vary": "Origin"}
    if origin is not None:
        leave |= {
            "Access-Control-Allow-Origin": origin,
            "Access-Control-Allow-Methods": METHODS,
            "Access-Control-Allow-Headers": HEADERS,
            "Access-Control-Max-Age": FOR_SECONDS,
        }
    return Response(status_code=HTTPStatus.NO_CONTENT, headers=leave)
