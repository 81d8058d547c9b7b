"""`encore serve`: the service, in one process or several."""

import asyncio
import os
import signal
import socket
import tempfile
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated

import structlog
import typer
import uvicorn
from uvicorn.config import STARTUP_FAILURE
from uvicorn.supervisors import Multiprocess

from app import logs, workers
from app.cli import sockets
from app.cli.console import Failed, note
from app.cli.session import DatabaseUrl, configured, revision_of, unsuited
from app.main import create_app
from app.services import warming
from app.services.beside import beside
from app.settings import Settings, Telemetry
from app.storage import migrate

GRACE = 30  # seconds that requests have to end in once the service is to stop
SILENCE = 30  # seconds after which a worker that says nothing is replaced

logger = structlog.get_logger()


def command(
    *,
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port; 0 is any free one.")] = None,
    processes: Annotated[
        int | None,
        typer.Option("--workers", help="Processes. SQLite takes exactly one."),
    ] = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Serve requests until told to stop; those begun are answered first.

    Options left out are taken from ENCORE_HOST, ENCORE_PORT and so on. Serve several
    processes on PostgreSQL only: SQLite has one writer.
    """
    settings = configured(
        host=host, port=port, workers=processes, database_url=database_url
    )
    if settings.on_sqlite and settings.workers > 1:
        note(f"SQLite has one writer: serving with 1 process, not {settings.workers}.")
        settings = settings.with_changes(workers=1)
    logs.configure(settings.log_level)
    _look_for_packages()
    asyncio.run(_look(settings))
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # told to stop: no fault
    with suppress(KeyboardInterrupt):
        if settings.workers == 1:
            serve_alone(settings)
        else:
            serve_together(settings)


def _look_for_packages() -> None:
    if Telemetry().on:
        try:
            import_module("app.telemetry")
        except ModuleNotFoundError as error:
            extra = "it comes with the extra `otel`, or unset OTEL_*"
            raise Failed(f"{error.name} is missing: {extra}.", status=2) from error


async def _look(settings: Settings) -> None:
    """See that the database answers and is migrated, before a port is taken.

    Tables of a later release will do: what is old must be able to start once more while
    a new release comes, and when it is taken back.
    """
    present = await revision_of(settings)
    if migrate.is_behind(present):
        raise unsuited(settings, present)
    if present != migrate.head():
        logger.warning("the database is of a later release", revision=present)


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
    logger.info("compiling")
    beside(warming.warm_up).result()
    taken = sockets.listen(settings.host, settings.port)
    logger.info("serving", address=sockets.address(taken), workers=settings.workers)
    with tempfile.TemporaryDirectory(prefix="encore-metrics-", dir=_memory()) as shared:
        os.environ |= {
            workers.DIRECTORY: shared,
            "ENCORE_WORKERS": str(settings.workers),
        }
        if Settings().database_url != settings.database_url:
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
        together = Multiprocess(config, sockets=[taken])
        beside(partial(_close_at_end, together, taken))
        together.run()
    if any(process.exitcode == STARTUP_FAILURE for process in together.processes):
        raise Failed("A process could not start: see the log.", status=STARTUP_FAILURE)


def _close_at_end(together: Multiprocess, taken: socket.socket) -> None:
    """Let go of the port with the processes, else callers wait for whom nobody answers.

    They are refused at once instead, and can go elsewhere.
    """
    together.should_exit.wait()
    taken.close()


def _memory() -> str | None:
    """Where files are never written to a disk, for which requests would wait."""
    memory = Path("/dev/shm")  # noqa: S108 - a folder of our own is made in it
    return str(memory) if os.access(memory, os.W_OK) else None
