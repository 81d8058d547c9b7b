"""Units of work and reads that traced requests remember."""

from collections.abc import Callable, Sequence
from functools import partial
from time import perf_counter
from typing import TypeVar

import sqlalchemy as sa
from sqlalchemy.util import greenlet_spawn

from app import tracing
from app.storage.prepared import Params, Row, Statements
from app.storage.store import Read, Store

T = TypeVar("T")


async def perform(work: Callable[[Store], T], store: Store) -> T:
    """Run a unit of work, of which the reads and the decision are remembered."""
    recorder = tracing.current.get()
    if recorder is None:
        return await greenlet_spawn(work, store)
    with recorder.within(f"unit {_name(work)}"):
        return await greenlet_spawn(work, store)


def reads(statements: Statements, read: Read) -> Read:
    """Remember what is read; statements hold no values of users."""

    def noted(statement: sa.Executable, params: Params) -> Sequence[Row]:
        if tracing.current.get() is None:
            return read(statement, params)
        began = perf_counter()
        found = read(statement, params)
        text = statements.prepared(statement).text
        names = {"db.system.name": statements.system, "db.query.text": text}
        tracing.note("read", began, **names)
        return found

    return noted


def _name(work: Callable[..., object]) -> str:
    while isinstance(work, partial):
        work = work.func
    return getattr(work, "__qualname__", type(work).__name__)
