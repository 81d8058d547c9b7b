"""Puts the service together."""

import warnings
from functools import partial
from importlib import import_module

from fastapi import FastAPI
from pydantic.warnings import UnsupportedFieldAttributeWarning
from starlette.middleware import Middleware

from app import __version__, lifespan, logs
from app.api import (
    admin,
    bounds,
    clock,
    document,
    experiments,
    guard,
    health,
    imports,
    items,
    listening,
    metrics,
    models,
    policies,
    problems,
    publications,
    simulations,
    users,
)
from app.api import (
    keys as key_routes,
)
from app.api.cross_origin import CrossOrigin
from app.api.middleware import BodyLimit, Observed, PathsAsSent
from app.api.straight import Straight
from app.api.traced import Traced
from app.settings import Settings, Telemetry
from app.tracing import Tracer
from app.web import docs, files, pages

ROUTERS = (
    listening.router,
    users.router,
    imports.router,
    items.router,
    models.router,
    admin.router,
    policies.router,
    experiments.router,
    guard.router,
    clock.router,
    publications.router,
    bounds.router,
    simulations.router,
    key_routes.router,
    health.router,
    metrics.router,
    docs.router,
    pages.router,
)


def create_app(settings: Settings | None = None) -> FastAPI:
    """The service for these settings, or for those of the environment."""
    settings = settings or Settings()
    logs.configure(settings.log_level)
    tracer = _tracer(settings)
    # FastAPI silences it while it reads a route, but filters are global: a compiler in
    # another thread brings it back.
    warnings.filterwarnings("ignore", category=UnsupportedFieldAttributeWarning)
    app = FastAPI(
        title="Encore",
        version=__version__,
        lifespan=partial(lifespan.run, settings=settings, tracer=tracer),
        openapi_url=None,
        redirect_slashes=False,
        generate_unique_id_function=document.name_of,
        telemetry={"tracing": False},
        middleware=[
            Middleware(PathsAsSent),
            Middleware(Observed),
            *([] if tracer is None else [Middleware(Traced, tracer=tracer)]),
            Middleware(CrossOrigin),
            Middleware(
                BodyLimit,
                limit=settings.body_limit,
                import_limit=settings.import_limit,
            ),
            Middleware(Straight),
        ],
    )
    problems.install(app, ROUTERS)
    document.install(app)
    app.mount("/static", files.static)
    for router in ROUTERS:
        app.include_router(router)
    return app


def _tracer(settings: Settings) -> Tracer | None:
    """What traces requests, if anything does; only then its packages are needed."""
    telemetry = Telemetry()
    if not telemetry.on:
        return None
    tracer: Tracer = import_module("app.telemetry").OpenTelemetry(
        telemetry, trusting=settings.trust_traceparent
    )
    return tracer
