"""Threads for what is long, so that it does not hold up other requests."""

import asyncio
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from sqlalchemy.util import await_only

from app.errors import Overloaded

T = TypeVar("T")

THREADS = os.cpu_count() or 1
WAITING = 64  # for each thread


class Aside:
    """Some threads; what would wait too long behind them is refused.

    Compiled code runs in them without the interpreter's lock.
    """

    def __init__(self, threads: int = THREADS, most: int = WAITING * THREADS) -> None:
        self._executor = ThreadPoolExecutor(threads, thread_name_prefix="aside")
        self._most = most
        self._taken = 0

    def run(self, work: Callable[[], T]) -> T:
        """Run this in a thread, from within a unit of work."""
        if self._taken >= self._most:
            raise Overloaded(f"{self._taken} long computations are waiting.")
        self._taken += 1
        try:
            loop = asyncio.get_running_loop()
            return await_only(loop.run_in_executor(self._executor, work))
        finally:
            self._taken -= 1

    def close(self) -> None:
        """Finish what runs, drop what waits."""
        self._executor.shutdown(cancel_futures=True)
