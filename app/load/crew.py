"""The processes that make a load together, and what they are told to do."""

import asyncio
import multiprocessing
import selectors
import signal
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple, Self, TypeAlias

from app.load.drive import Pace
from app.load.load import Load
from app.load.plan import Plan
from app.load.tally import Tally

Told: TypeAlias = Callable[[int, int], None]
Channel: TypeAlias = "Connection[Any, Any]"


class Order(NamedTuple):
    """What all processes do now. Without a pace: what `name` says."""

    name: str
    pace: Pace | None = None


class Progress(NamedTuple):
    """How many answers there are so far, and how many failures."""

    answered: int
    failed: int


class Ended(Exception):
    """A process ended before its work was done."""


class Crew:
    """Processes, each with a part of the users, the connections and the rate.

    This process only waits: what it shows does not delay what they send.
    """

    def __init__(self, plan: Plan, processes: int) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipes: list[Channel] = []
        self._processes = []
        for number in range(processes):
            here, there = context.Pipe()
            part = plan.share(number, processes)
            process = context.Process(target=work, args=(there, part), daemon=True)
            process.start()
            there.close()
            self._pipes.append(here)
            self._processes.append(process)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.terminate()
            process.join()

    def drive(self, pace: Pace, told: Told) -> Tally:
        """Ask and answer at this pace, all together."""
        rate = None if pace.rate is None else pace.rate / len(self._pipes)
        order = Order("drive", Pace(rate, pace.seconds, pace.even))
        return self._obeyed(order, told)

    def read_back(self, told: Told) -> Tally:
        return self._obeyed(Order("read_back"), told)

    def erase(self, told: Told) -> Tally:
        return self._obeyed(Order("erase"), told)

    def _obeyed(self, order: Order, told: Told) -> Tally:
        for pipe in self._pipes:
            pipe.send(order)
        total, busy = Tally(), {*self._pipes}
        progress = dict.fromkeys(self._pipes, Progress(0, 0))
        while busy:
            ready = {*wait([*busy])}
            for pipe in [*busy & ready]:
                said = _received(pipe)
                if isinstance(said, Tally):
                    busy.discard(pipe)
                    total.merge(said)
                else:
                    progress[pipe] = said
            told(*map(sum, zip(*progress.values(), strict=True)))
        return total


def _received(pipe: Channel) -> Tally | Progress:
    try:
        said = pipe.recv()
    except EOFError as error:
        raise Ended("A process of the load ended.") from error
    if isinstance(said, Tally | Progress):
        return said
    raise TypeError(said)


def work(pipe: Channel, plan: Plan) -> None:
    """Do as told until nobody tells."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started this is interrupted
    with asyncio.Runner(loop_factory=precise) as runner:
        load = runner.run(_made(pipe, plan))
        with suppress(EOFError):
            while True:
                pipe.send(runner.run(_done(load, pipe.recv())))


def precise() -> asyncio.AbstractEventLoop:
    """A loop that wakes within microseconds; others count in milliseconds."""
    return asyncio.SelectorEventLoop(selectors.SelectSelector())


async def _made(pipe: Channel, plan: Plan) -> Load:
    return Load(plan, lambda tally: pipe.send(Progress(tally.answered, tally.failed)))


async def _done(load: Load, order: Order) -> Tally:
    if order.pace is not None:
        return await load.drive(order.pace)
    return await (load.erase() if order.name == "erase" else load.read_back())
