"""A connection: HTTP/1.1, kept alive, one request on its way at a time.

Written on asyncio's protocols and a parser in C: what takes time here is taken for the
service's, and an ordinary client takes as long as the service does.
"""

import asyncio
import ssl
from collections.abc import Callable
from typing import NamedTuple

import httptools

from app.load.plan import Target

STALE = 3.0  # seconds; servers close what is idle for five

REFUSED, LOST, TIMEOUT, GARBLED = "refused", "connection_lost", "timeout", "garbled"


class Reply(NamedTuple):
    """An answer, and when it was complete. Status 0: none came, `broken` says why."""

    status: int
    body: bytes
    at: float
    broken: str = ""


Heard = Callable[["Wire", Reply], None]


class Wire:
    """Sends a request, hands its answer on; connects when it must."""

    def __init__(
        self, target: Target, tls: ssl.SSLContext | None, patience: float
    ) -> None:
        self._target = target
        self._tls = tls
        self._patience = patience
        self._loop = asyncio.get_running_loop()
        self._stream: _Stream | None = None
        self._used = 0.0
        self._heard: Heard | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._opening: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Connect, if need be."""
        if self._stream is None:
            _, self._stream = await self._loop.create_connection(
                lambda: _Stream(self),
                self._target.host,
                self._target.port,
                ssl=self._tls,
            )
            self._used = self._loop.time()

    def close(self) -> None:
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.transport.abort()

    def ask(self, request: bytes, heard: Heard) -> None:
        """Send a request; `heard` is called once, with the answer or without."""
        self._heard = heard
        now = self._loop.time()
        self._timer = self._loop.call_at(now + self._patience, self.end, TIMEOUT)
        if now - self._used > STALE:
            self.close()
        if self._stream is None:
            self._opening = self._loop.create_task(self._open_and_send(request))
        else:
            self._stream.transport.write(request)

    async def _open_and_send(self, request: bytes) -> None:
        try:
            await self.open()
        except OSError:
            self.end(REFUSED)
            return
        if self._heard is not None and self._stream is not None:
            self._stream.transport.write(request)

    def hear(self, status: int, body: bytes, *, more: bool) -> None:
        """Take the answer; `more`: the connection can carry another request."""
        self._used = self._loop.time()
        if not more:
            self.close()
        self._hand(Reply(status, body, self._used))

    def end(self, reason: str) -> None:
        """No answer came, or none that can be read; nor may it come later."""
        self.close()
        self._hand(Reply(0, b"", self._loop.time(), reason))

    def has_lost(self, stream: "_Stream") -> None:
        if self._stream is stream:
            self._stream = None
            self.end(LOST)

    def _hand(self, reply: Reply) -> None:
        heard, self._heard = self._heard, None
        if self._timer is not None:
            self._timer.cancel()
        if heard is not None:
            heard(self, reply)


class _Stream(asyncio.Protocol):
    """One connection, as long as it lasts."""

    transport: asyncio.Transport

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._parser = httptools.HttpResponseParser(self)
        self._body: list[bytes] = []

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if isinstance(transport, asyncio.Transport):
            self.transport = transport

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        self._wire.has_lost(self)

    def data_received(self, data: bytes) -> None:
        try:
            self._parser.feed_data(data)
        except httptools.HttpParserError:
            self._wire.end(GARBLED)

    def on_body(self, body: bytes) -> None:
        self._body.append(body)

    def on_message_complete(self) -> None:
        body = b"".join(self._body)
        self._body.clear()
        status, more = self._parser.get_status_code(), self._parser.should_keep_alive()
        self._wire.hear(status, body, more=more)
