"""Where the work of learning is done: on all processors, or on a cluster."""

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Annotated

import typer

from app.cli.console import Failed
from learning.em import Spread

Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        help="Address of a Dask scheduler, whose workers do the work.",
        show_default=False,
    ),
]


@contextmanager
def spreading(scheduler: str | None) -> Iterator[Spread]:
    """All processors of this machine, or the cluster of a scheduler."""
    if scheduler is None:
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            yield pool.map
        return
    try:
        from learning.cluster import NoCluster, cluster  # noqa: PLC0415 - of an extra
    except ModuleNotFoundError as error:
        message = f"{error.name} is missing: pip install '.[dask]' in a clone."
        raise Failed(message) from error
    try:
        with cluster(scheduler) as spread:
            yield spread
    except NoCluster as error:
        raise Failed(f"The cluster of {scheduler} does not work: {error}.") from error
