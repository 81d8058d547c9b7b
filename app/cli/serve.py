"""`encore serve`: the service, in one process or several."""

import asyncio
import os
import signal
import tempfile
from contextlib import suppress
from typing import Annotated

import structlog
import typer
import uvicorn
from uvicorn.supervisors import Multiprocess

from app import logs
from app.cli import sockets
from app.cli.console import note
from app.cli.session import DatabaseUrl, configured, opened
from app.main import create_app
from app.services import warming
from app.services.beside import beside
from app.settings import Settings

GRACE = 30  # seconds that requests have to end in once the service is to stop
SILENCE = 30  # seconds after which a worker that says nothing is replaced

logger = structlog.get_logger()


def command(
    *,
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port; 0 is any free one.")] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes. SQLite takes exactly one.")
    ] = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Serve requests until told to stop; those begun are answered first.

    Options left out are taken from ENCORE_HOST, ENCORE_PORT and so on. Serve several
    processes on PostgreSQL only: SQLite has one writer.
    """
    settings = configured(
        host=host, port=port, workers=workers, database_url=database_url
    )
    if settings.on_sqlite and settings.workers > 1:
        note(f"SQLite has one writer: serving with 1 process, not {settings.workers}.")
        settings = settings.with_changes(workers=1)
    asyncio.run(_look(settings))
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # told to stop: no fault
    with suppress(KeyboardInterrupt):
        if settings.workers == 1:
            serve_alone(settings)
        else:
            serve_together(settings)


async def _look(settings: Settings) -> None:
    """See that the database answers and is migrated, before a port is taken."""
    async with opened(settings):
        pass


def serve_alone(settings: Settings) -> None:
    app = create_app(settings)
    taken = sockets.listen(settings.host, settings.port)
    logger.info("serving", address=sockets.address(taken), workers=1)
    uvicorn.Server(
        uvicorn.Config(
            app,
            log_config=None,
            access_log=False,
            timeout_graceful_shutdown=GRACE,
        )
    ).run([taken])


def serve_together(settings: Settings) -> None:
    """Serve with several processes, which find the decision code compiled."""
    logs.configure(settings.log_level)
    logger.info("compiling")
    beside(warming.warm_up).result()
    taken = sockets.listen(settings.host, settings.port)
    logger.info("serving", address=sockets.address(taken), workers=settings.workers)
    with tempfile.TemporaryDirectory(prefix="encore-metrics-") as metrics:
        os.environ["PROMETHEUS_MULTIPROC_DIR"] = metrics
        os.environ["ENCORE_DATABASE_URL"] = settings.database_url
        config = uvicorn.Config(
            "app.main:create_app",
            factory=True,
            workers=settings.workers,
            log_config=None,
            access_log=False,
            timeout_graceful_shutdown=GRACE,
            timeout_worker_healthcheck=SILENCE,
        )
        Multiprocess(config, sockets=[taken]).run()
