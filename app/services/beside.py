"""Work in a thread whose end nobody has to await.

Ctrl-C reaches the main thread alone: a compiler that is interrupted there ends in
disorder, and one that runs here does not notice.
"""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

T = TypeVar("T")


def beside(work: Callable[[], T]) -> Future[T]:
    """Begin work that the end of the process cuts off."""
    done: Future[T] = Future()

    def run() -> None:
        try:
            result = work()
        except Exception as error:  # noqa: BLE001 - it is raised where it is awaited
            done.set_exception(error)
        else:
            done.set_result(result)

    done.set_running_or_notify_cancel()
    threading.Thread(target=run, name="beside", daemon=True).start()
    return done
