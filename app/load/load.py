"""One process's part of a load: it drives, reads back, erases."""

import asyncio
import ssl
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from contextlib import suppress
from random import Random

from app.load.audience import Audience
from app.load.drive import OK, Drive, Pace, code_of
from app.load.history import History
from app.load.listener import Listener
from app.load.plan import Plan, path_of
from app.load.tally import Failure, Fault, Step, Tally
from app.load.wire import Reply, Wire

UNREAD = "unread_history"
NO_CONTENT = 204
CALM = 0.25  # seconds between two words on how it goes
ATTEMPTS = 5
PAUSE = 0.5  # seconds before something is asked for again

Report = Callable[[Tally], None]


class Load:
    """Listeners, and the connections over which they ask."""

    def __init__(self, plan: Plan, report: Report) -> None:
        self._plan = plan
        self._report = report
        self._draw = Random(plan.seed)  # noqa: S311 - no secret
        self._listeners = [Listener(plan, user, self._draw) for user in plan.users]
        self._audience = Audience(self._listeners, plan.connections)
        tls = ssl.create_default_context() if plan.target.tls else None
        self._wires = [
            Wire(plan.target, tls, plan.patience) for _ in range(plan.connections)
        ]

    async def drive(self, pace: Pace) -> Tally:
        """Ask and answer at a pace."""
        drive = Drive(self._audience, self._wires, pace, self._draw)
        await self._connected(drive.run(), drive.tally)
        return drive.tally

    async def read_back(self) -> Tally:
        """Compare the histories of all who were answered with what they were told."""
        concerned = [one for one in self._listeners if one.taken or one.open]
        tally = Tally(open=sum(one.open for one in concerned))
        await self._connected(self._for_each(concerned, self._compare, tally), tally)
        return tally

    async def erase(self) -> Tally:
        """Erase these users."""
        tally = Tally()
        await self._connected(
            self._for_each(self._listeners, self._forget, tally), tally
        )
        return tally

    async def _connected(self, work: Coroutine[None, None, None], tally: Tally) -> None:
        """Work while all connections are open, and tell now and then how it goes."""
        for wire in self._wires:
            with suppress(OSError):  # it is opened when it is needed, else a failure
                await wire.open()
        task = asyncio.create_task(work)
        while not (await asyncio.wait({task}, timeout=CALM))[0]:
            self._report(tally)
        for wire in self._wires:
            wire.close()
        task.result()

    async def _for_each(
        self,
        listeners: list[Listener],
        treat: Callable[[Wire, Listener, Tally], Awaitable[None]],
        tally: Tally,
    ) -> None:
        """Treat one after the other, as many at a time as there are connections."""
        left = iter(listeners)
        await asyncio.gather(
            *(self._one_by_one(wire, left, treat, tally) for wire in self._wires)
        )

    async def _one_by_one(
        self,
        wire: Wire,
        left: Iterator[Listener],
        treat: Callable[[Wire, Listener, Tally], Awaitable[None]],
        tally: Tally,
    ) -> None:
        for listener in left:
            await treat(wire, listener, tally)
            tally.answered += 1

    async def _compare(self, wire: Wire, listener: Listener, tally: Tally) -> None:
        history, more = History(listener), True
        while more:
            request = self._plan.request("GET", history.path())
            reply = await self._fetch(wire, Step.READ, request, tally)
            if reply is None:
                detail = f"{len(listener.taken)} answers were not read back"
                tally.note([Fault(UNREAD, listener.name, detail)])
                return
            more = history.hear(reply)
        tally.compared += len(listener.taken)
        tally.note(history.faults())

    async def _forget(self, wire: Wire, listener: Listener, tally: Tally) -> None:
        request = self._plan.request("DELETE", path_of(listener.name))
        await self._fetch(wire, Step.ERASE, request, tally)

    async def _fetch(
        self, wire: Wire, step: Step, request: bytes, tally: Tally
    ) -> bytes | None:
        """The body of an answer; None: there is none, whatever was tried."""
        for _ in range(ATTEMPTS):
            reply = await _asked(wire, request)
            if reply.status in {OK, NO_CONTENT}:
                return reply.body
            code = reply.broken or code_of(reply.body)
            if code == "user_not_found":  # who was never answered need not be known
                return b""
            tally.failures[Failure(step, reply.status, code)] += 1
            await asyncio.sleep(PAUSE)
        return None


async def _asked(wire: Wire, request: bytes) -> Reply:
    heard: asyncio.Future[Reply] = asyncio.get_running_loop().create_future()
    wire.ask(request, lambda _, reply: heard.set_result(reply))
    return await heard
