"""What goes on in a process from its start to its end, beside the requests."""

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial

import structlog
from fastapi import FastAPI

from app.api.context import Context
from app.domain import Scope
from app.errors import DatabaseUnavailable
from app.metrics import READY
from app.services import keys, policy, warming
from app.services.beside import beside
from app.services.keys import KeyRing
from app.services.live import Live
from app.services.vitals import Vitals
from app.settings import Settings
from app.storage.database import Database
from app.tracing import Tracer

PATIENCE = 10.0  # seconds that a start waits for the database; then it answers 503
RETRY = 1.0  # seconds after which it is tried again

logger = structlog.get_logger()


@asynccontextmanager
async def run(
    app: FastAPI, settings: Settings, tracer: Tracer | None
) -> AsyncIterator[None]:
    database = Database(settings, is_traced=tracer is not None)
    live = Live(settings.pending_ttl, settings.decision_budget / 1000)
    context = Context(settings, database, live, KeyRing(database))
    app.state.context = context
    vitals = asyncio.create_task(Vitals(database).run())
    begun = asyncio.create_task(_begin(context))
    await asyncio.wait((begun,), timeout=PATIENCE)
    if begun.done():
        begun.result()
    background = asyncio.create_task(_work(context, begun))
    compiling = asyncio.create_task(_compile_others(context))
    if settings.workers > 1 and begun.done():  # others answer until this one can
        await context.warm.wait()
    try:
        yield
    finally:
        vitals.cancel()
        begun.cancel()
        compiling.cancel()
        context.index_builder.stop()
        context.guard.stop()
        context.tallies.stop()
        context.shadows.stop()
        context.simulator.stop()
        if not context.warm.is_set():
            background.cancel()
        with suppress(asyncio.CancelledError):
            await background
        with suppress(asyncio.CancelledError):
            await compiling
        await database.close()
        if tracer is not None:
            await _close(tracer)


async def _close(tracer: Tracer) -> None:
    """Send the last traces, if the collector takes them soon."""
    sent = asyncio.wrap_future(beside(tracer.close))
    await asyncio.wait((sent,), timeout=PATIENCE)


async def _begin(context: Context) -> None:
    """See that somebody can decide, and the first key is known.

    The database may be away when a process takes the place of one that died.
    """
    while True:
        try:
            await context.database.run(policy.ensure_one)
            await _ensure_key(context)
        except DatabaseUnavailable:
            logger.warning("the database does not answer")
            await asyncio.sleep(RETRY)
        else:
            return


async def _ensure_key(context: Context) -> None:
    if context.settings.bootstrap_key is not None:
        secret = context.settings.bootstrap_key.get_secret_value()
        await context.database.run(
            partial(keys.ensure, secret=secret, scope=Scope.ADMIN, name="bootstrap")
        )


async def _work(context: Context, begun: asyncio.Task[None]) -> None:
    """What goes on beside the requests."""
    await begun
    await _warm(context)
    works = [context.tallies.run(), context.shadows.run()]
    if context.settings.index_tables == "auto":
        works.append(context.index_builder.run())
    if context.settings.guard != "off":
        works.append(context.guard.run())
    await asyncio.gather(*works)


async def _warm(context: Context) -> None:
    """Compile what decides now, so that no request waits for a compiler."""
    began = time.perf_counter()
    logger.info("compiling")
    for work in (_compile_needed, _load):
        try:
            await work(context)
        except Exception:  # requests compile and load what they need
            logger.exception("not_warm", work=work.__name__.strip("_"))
    context.warm.set()
    READY.set(1)
    logger.info("ready", seconds=round(time.perf_counter() - began, 1))


async def _compile_needed(context: Context) -> None:
    await warming.compiled(await context.database.run(warming.in_force))


async def _load(context: Context) -> None:
    await context.database.run(partial(warming.load, live=context.live))


async def _compile_others(context: Context) -> None:
    """Compile the policies that may be put in force."""
    await context.warm.wait()
    await warming.compiled(warming.variants())
