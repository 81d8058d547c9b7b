"""Puts the service together."""

import asyncio
import time
import warnings
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial

import structlog
from fastapi import FastAPI
from pydantic.warnings import UnsupportedFieldAttributeWarning
from starlette.middleware import Middleware

from app import __version__, logs
from app.api import (
    admin,
    bounds,
    clock,
    document,
    guard,
    health,
    imports,
    items,
    listening,
    metrics,
    models,
    problems,
    publications,
    users,
)
from app.api import (
    keys as key_routes,
)
from app.api.context import Context
from app.api.cross_origin import CrossOrigin
from app.api.middleware import BodyLimit, Observed, PathsAsSent
from app.domain import Scope
from app.services import keys, policy, warming
from app.services.keys import KeyRing
from app.services.live import Live
from app.settings import Settings
from app.storage.database import Database
from app.web import docs, files

ROUTERS = (
    listening.router,
    users.router,
    imports.router,
    items.router,
    models.router,
    admin.router,
    guard.router,
    clock.router,
    publications.router,
    bounds.router,
    key_routes.router,
    health.router,
    metrics.router,
    docs.router,
)

logger = structlog.get_logger()


def create_app(settings: Settings | None = None) -> FastAPI:
    """The service for these settings, or for those of the environment."""
    settings = settings or Settings()
    logs.configure(settings.log_level)
    # FastAPI silences it while it reads a route, but filters are global: a compiler in
    # another thread brings it back.
    warnings.filterwarnings("ignore", category=UnsupportedFieldAttributeWarning)
    app = FastAPI(
        title="Encore",
        version=__version__,
        lifespan=partial(_lifespan, settings=settings),
        openapi_url=None,
        redirect_slashes=False,
        generate_unique_id_function=document.name_of,
        telemetry={"tracing": False},
        middleware=[
            Middleware(PathsAsSent),
            Middleware(Observed),
            Middleware(CrossOrigin),
            Middleware(
                BodyLimit,
                limit=settings.body_limit,
                import_limit=settings.import_limit,
            ),
        ],
    )
    problems.install(app, ROUTERS)
    document.install(app)
    app.mount("/static", files.static)
    for router in ROUTERS:
        app.include_router(router)
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI, settings: Settings) -> AsyncIterator[None]:
    database = Database(settings)
    context = Context(settings, database, Live(settings.pending_ttl), KeyRing(database))
    app.state.context = context
    await database.run(policy.ensure_one)
    if settings.bootstrap_key is not None:
        secret = settings.bootstrap_key.get_secret_value()
        await database.run(
            partial(keys.ensure, secret=secret, scope=Scope.ADMIN, name="bootstrap")
        )
    background = asyncio.create_task(_work(context))
    compiling = asyncio.create_task(_compile_others(context))
    try:
        yield
    finally:
        compiling.cancel()
        context.index_builder.stop()
        context.guard.stop()
        if not context.warm.is_set():
            background.cancel()
        with suppress(asyncio.CancelledError):
            await background
        with suppress(asyncio.CancelledError):
            await compiling
        await database.close()


async def _work(context: Context) -> None:
    """What goes on beside the requests."""
    await _warm(context)
    works = []
    if context.settings.index_tables == "auto":
        works.append(context.index_builder.run())
    if context.settings.guard != "off":
        works.append(context.guard.run())
    await asyncio.gather(*works)


async def _warm(context: Context) -> None:
    """Compile what decides now, so that no request waits for a compiler."""
    began = time.perf_counter()
    logger.info("compiling")
    await _compiled(context, in_force=True)
    context.warm.set()
    logger.info("ready", seconds=round(time.perf_counter() - began, 1))


async def _compile_others(context: Context) -> None:
    """Compile the policies that may be put in force."""
    await context.warm.wait()
    await _compiled(context, in_force=False)


async def _compiled(context: Context, *, in_force: bool) -> None:
    try:
        if in_force:
            await warming.compiled(await context.database.run(warming.in_force))
        else:
            for other in warming.variants():
                await warming.compiled([other])
    except Exception:  # requests compile what they need
        logger.exception("compiling_failed")
