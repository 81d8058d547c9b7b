"""Which of the processes that serve together this one is, and which of them live.

Each takes the lowest number that is free, and holds a lock on its file while it lives;
the kernel takes the lock back however a process ends. So there are no more numbers than
processes, whatever dies and is started again, and nobody must tell who is dead.
"""

import fcntl
import itertools
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

DIRECTORY = "PROMETHEUS_MULTIPROC_DIR"
LIVE = "gauge_live"  # how files of gauges begin that tell of the living

_held: list[BinaryIO] = []


def directory() -> Path | None:
    """What the processes share; None where one serves alone."""
    path = os.environ.get(DIRECTORY)
    return None if path is None else Path(path)


def take(shared: Path) -> int:
    """Take a number for as long as this process lives."""
    with _alone(shared):
        for number in itertools.count():
            file = (shared / f"{number}.lock").open("wb")
            if _locked(file, fcntl.LOCK_EX):
                _held.append(file)
                _forget(shared, number)
                return number
            file.close()
    raise AssertionError  # numbers do not end


def files(shared: Path) -> list[str]:
    """What the processes have counted; of the dead, not what they were like."""
    with _alone(shared):
        living = {path.stem for path in shared.glob("*.lock") if _is_held(path)}
        return [
            str(path)
            for path in shared.glob("*.db")
            if path.stat().st_size > 0  # it is not, in the moment in which it is made
            and not (path.name.startswith(LIVE) and _number(path) not in living)
        ]


def _number(path: Path) -> str:
    return path.stem.rpartition("_")[2]


def _forget(shared: Path, number: int) -> None:
    """Drop what the one before was like; what it counted goes on."""
    for path in shared.glob(f"{LIVE}*_{number}.db"):
        path.unlink()


def _is_held(path: Path) -> bool:
    with path.open("rb") as file:
        return not _locked(file, fcntl.LOCK_SH)


def _locked(file: BinaryIO, kind: int) -> bool:
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def _alone(shared: Path) -> Iterator[None]:
    """Keep others from taking and looking meanwhile."""
    with (shared / "door").open("wb") as door:
        fcntl.flock(door, fcntl.LOCK_EX)
        yield
