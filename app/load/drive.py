"""Sends requests when they are due, whatever became of those before them.

A request that is due has its time from then on: while all connections are busy it
waits, and its waiting counts. A tool that sends the next request when the last one is
answered asks a slow service less often, and never sees what its users wait for.
"""

import asyncio
import json
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from random import Random

from app.load.audience import Audience
from app.load.listener import Listener
from app.load.tally import Failure, Tally
from app.load.wire import Reply, Wire

PAUSE = 0.1  # seconds before a connection that failed is tried again
OK = 200


@dataclass(frozen=True, slots=True)
class Pace:
    """How often, and for how long.

    rate:    requests a second; None: as many as are answered
    seconds: for which requests fall due
    even:    in equal steps of time, else at random
    """

    rate: float | None
    seconds: float
    even: bool = True


class Drive:
    """Listeners who ask at a pace, in turn, over as many connections as there are."""

    def __init__(
        self, audience: Audience, wires: Sequence[Wire], pace: Pace, draw: Random
    ) -> None:
        self.tally = Tally()
        self._audience = audience
        self._free = list(wires)
        self._busy = 0
        self._pace = pace
        self._draw = draw
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[tuple[float, float]] = deque()  # due, and noticed
        self._due = self._end = 0.0
        self._over = asyncio.Event()

    async def run(self) -> None:
        """Ask until the time is over, then wait for the last answer."""
        cpu, began = time.process_time(), self._loop.time()
        self._end = began + self._pace.seconds
        self._due = began + self._gap()
        self._tick()
        await self._over.wait()
        self.tally.seconds = self._loop.time() - began
        self.tally.cpu = time.process_time() - cpu

    def _gap(self) -> float:
        """Seconds to the next request."""
        rate = self._pace.rate
        if rate is None:
            return self._pace.seconds
        return 1 / rate if self._pace.even else self._draw.expovariate(rate)

    def _tick(self) -> None:
        """Notice what is due, and come back when the next one is."""
        now = self._loop.time()
        while self._due <= now and self._due < self._end:
            self.tally.late.add(now - self._due)
            self._waiting.append((self._due, now))
            self._due += self._gap()
        self._send()
        if self._due < self._end:
            self._loop.call_at(self._due, self._tick)
        else:
            self.tally.backlog = len(self._waiting)
            self._loop.call_at(self._end, self._stop_if_done)

    def _send(self) -> None:
        now = self._loop.time()
        while self._free and self._waiting:
            due, noticed = self._waiting.popleft()
            self.tally.queued.add(now - noticed)
            self._ask(due)
        while self._pace.rate is None and self._free and now < self._end:
            self._ask(now)

    def _ask(self, due: float) -> None:
        self._busy += 1
        wire, listener = self._free.pop(), self._audience.call()
        wire.ask(listener.request(), partial(self._hear, listener, due))

    def _hear(self, listener: Listener, due: float, wire: Wire, reply: Reply) -> None:
        if reply.status == OK:
            self.tally.took(listener.step, reply.at - due)
            self.tally.checked += 1
            self.tally.note(listener.hear(reply.body))
        else:
            code = reply.broken or code_of(reply.body)
            self.tally.failures[Failure(listener.step, reply.status, code)] += 1
            self.tally.note(listener.miss(code))
        self._audience.dismiss(listener)
        if reply.broken:
            self._loop.call_later(PAUSE, self._release, wire)
        else:
            self._release(wire)

    def _release(self, wire: Wire) -> None:
        self._busy -= 1
        self._free.append(wire)
        self._send()
        self._stop_if_done()

    def _stop_if_done(self) -> None:
        done = not self._busy and not self._waiting
        if done and self._loop.time() >= self._end:
            self._over.set()


def code_of(body: bytes) -> str:
    """What a problem calls itself."""
    try:
        told = json.loads(body)
    except ValueError:
        return "no_problem_json"
    return str(told.get("code")) if isinstance(told, dict) else "no_problem_json"
