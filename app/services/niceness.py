"""Threads that take what others leave."""

import os
import sys
import threading
from contextlib import suppress

NICENESS = 10


def give_way() -> None:
    """Let the requests come before this thread."""
    if sys.platform == "linux":  # where a thread has a niceness of its own
        with suppress(OSError):  # a container may forbid it
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
