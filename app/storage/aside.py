"""Threads for what is long, so that it does not hold up other requests."""

import asyncio
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

from sqlalchemy.util import await_only

from app.errors import Overloaded

T = TypeVar("T")

THREADS = os.cpu_count() or 1
WAITING = 64  # for each thread


class Late(Exception):
    """What was asked for was not there in time."""


class Aside:
    """Some threads; what would wait too long behind them is refused.

    Compiled code runs in them without the interpreter's lock.
    """

    def __init__(self, threads: int = THREADS, most: int = WAITING * THREADS) -> None:
        self._executor = ThreadPoolExecutor(threads, thread_name_prefix="aside")
        self._threads = threads
        self._most = most
        self._taken = 0
        self._foretold = 0.0

    @property
    def backlog(self) -> float:
        """Seconds until a thread is free, as far as that was foretold."""
        return self._foretold / self._threads if self._taken >= self._threads else 0.0

    def run(
        self,
        work: Callable[[], T],
        *,
        within: float | None = None,
        foretold: float = 0.0,
    ) -> T:
        """Run this in a thread, from within a unit of work.

        within:   seconds to wait for it; what has begun then goes on in its thread
        foretold: seconds that it may take

        Raises:
            Late: it was not done within so many seconds.
        """
        if self._taken >= self._most:
            raise Overloaded(f"{self._taken} long computations are waiting.")
        self._taken += 1
        self._foretold += foretold
        begun = self._executor.submit(work)
        done = asyncio.wrap_future(begun)
        done.add_done_callback(partial(self._end, foretold))
        if within is not None:
            await_only(asyncio.wait((done,), timeout=within))
            if not done.done():
                begun.cancel()
                raise Late
        return await_only(done)

    def close(self) -> None:
        """Finish what runs, drop what waits."""
        self._executor.shutdown(cancel_futures=True)

    def _end(self, foretold: float, done: "asyncio.Future[T]") -> None:
        self._taken -= 1
        self._foretold = self._foretold - foretold if self._taken else 0.0
        if not done.cancelled():
            done.exception()  # somebody may have given up waiting for it
