"""`encore bench`: load a running service, and hold it to its word."""

import secrets
from enum import StrEnum
from typing import Annotated

import httpx
import typer

from app.cli.console import AsJson, Failed
from app.load.plan import Plan, Target, Wishes

MOST = 500  # connections of a process: its loop takes no more files than 1024
PROBE = "/v1/users/bench-probe/playlist?length=1"  # changes nothing
REFUSALS = {401, 403, 404}


class Arrivals(StrEnum):
    """When requests fall due."""

    EVEN = "even"
    RANDOM = "random"


def command(
    *,
    url: Annotated[
        str, typer.Option(envvar="ENCORE_URL", help="Address of the service.")
    ] = "http://127.0.0.1:8000",
    key: Annotated[
        str,
        typer.Option(
            envvar="ENCORE_KEY", help="A key of scope serve.", show_default=False
        ),
    ],
    users: Annotated[int, typer.Option(min=1, help="Listeners who take turns.")] = 1000,
    concurrency: Annotated[
        int, typer.Option(min=1, help="Requests on their way at a time, at most.")
    ] = 64,
    duration: Annotated[float, typer.Option(min=1, help="Seconds of the run.")] = 30,
    rate: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            help="Requests a second. Left out: a share of the maximum, found first.",
            show_default=False,
        ),
    ] = None,
    load: Annotated[
        float, typer.Option(min=0.01, max=1, help="That share of the maximum.")
    ] = 0.7,
    arrivals: Annotated[
        Arrivals, typer.Option(help="In equal steps of time, or at random.")
    ] = Arrivals.EVEN,
    repeats: Annotated[
        float,
        typer.Option(min=0, max=1, help="Share of requests that are sent twice."),
    ] = 0.02,
    prefix: Annotated[
        str | None,
        typer.Option(
            help="Users who are there already: PREFIX0, PREFIX1, … They are kept.",
            show_default=False,
        ),
    ] = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="Do not erase the users afterwards.")
    ] = False,
    clock: Annotated[
        bool, typer.Option("--clock", help="Slots also move on by the clock.")
    ] = False,
    processes: Annotated[
        int, typer.Option(min=1, max=64, help="Processes that ask.")
    ] = 1,
    patience: Annotated[
        float, typer.Option(min=0.1, help="Seconds that an answer may take.")
    ] = 30,
    seed: Annotated[int, typer.Option(min=0, help="Of answers and arrivals.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Load a running service by the clock, and check every answer that it gives.

    Listeners ask for plays and answer them. A request is due at its time, whatever
    became of those before it, and its latency counts from then. At the end their
    histories are read back. Ends with 1 if an answer was lost, doubled or changed.
    """
    try:
        from app.cli import bench_run  # noqa: PLC0415 - of an extra
    except ModuleNotFoundError as error:
        message = f"{error.name} is missing: pip install '.[bench]' in a clone."
        raise Failed(message) from error
    _see_that_they_fit(users, concurrency, processes)
    target = _target(url)
    _look(url, key)
    plan = Plan(
        target,
        key,
        _names(users, prefix),
        concurrency,
        fresh=prefix is None,
        repeats=repeats,
        clock=clock,
        patience=patience,
        seed=seed,
    )
    wishes = Wishes(rate, load, duration, arrivals is Arrivals.EVEN, keep)
    bench_run.run(plan, processes, wishes, as_json=as_json)


def _see_that_they_fit(users: int, concurrency: int, processes: int) -> None:
    """All connections need a user, all processes a connection."""
    if users < concurrency:
        raise Failed(f"--users: {users} cannot ask {concurrency} at a time.", status=2)
    if processes > concurrency:
        message = f"--processes: {processes} cannot share {concurrency} connections."
        raise Failed(message, status=2)
    if concurrency > MOST * processes:
        message = f"--concurrency: a process has at most {MOST} connections."
        raise Failed(message, status=2)


def _names(users: int, prefix: str | None) -> list[str]:
    """Of users who are there, or of whom the service has never heard."""
    first = f"bench-{secrets.token_hex(4)}-" if prefix is None else prefix
    return [f"{first}{number}" for number in range(users)]


def _target(url: str) -> Target:
    try:
        return Target.of(url)
    except ValueError as error:
        raise Failed(f"--url: {error}", status=2) from error


def _look(url: str, key: str) -> None:
    """See that a service is there, takes the key, and has something to play."""
    headers = {"Authorization": f"Bearer {key}"}
    try:
        answer = httpx.get(f"{url.rstrip('/')}{PROBE}", headers=headers, timeout=60)
    except (httpx.HTTPError, httpx.InvalidURL) as error:
        raise Failed(f"{url} does not answer: {error}") from error
    if answer.status_code in REFUSALS:
        raise Failed(f"{url} cannot be tried: {answer.text}")
