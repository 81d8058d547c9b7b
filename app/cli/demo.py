"""`encore demo`: a database, a catalogue, keys and a server in one go."""

import asyncio
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from socket import socket
from typing import Annotated

import typer
import uvicorn

from app.cli import greeting, sockets
from app.cli.console import AsJson, Failed, note, progress, show_json, show_table
from app.cli.greeting import Invitation
from app.cli.migrate import bring_up_to_date
from app.cli.session import DatabaseUrl, Session, configured, perform
from app.demo import catalogue, trial
from app.demo.client import Client
from app.demo.trial import Lived, Trial
from app.domain import Scope
from app.main import create_app
from app.services import keys
from app.settings import Settings

DEFAULTS: dict[str, object] = {
    "database_url": "sqlite:///encore-demo.db",
    "log_level": "warning",
    "pending_ttl": 24 * 60 * 60,  # the play that is shown can be answered all day
}
BY = "encore demo"
GRACE = 5  # seconds that requests have to end in
PATIENCE = 3  # seconds after which it is told what takes so long


@dataclass(frozen=True, slots=True)
class Opening:
    """What is ready before the server starts."""

    settings: Settings
    socket: socket
    admin_key: str
    serve_key: str


@dataclass(frozen=True, slots=True)
class Wishes:
    """What is to be shown once it has started. No listeners: no trial."""

    trial: Trial
    stop: bool
    as_json: bool


def command(
    *,
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[
        int | None,
        typer.Option(help="Port. Left out: 8000, or the next one that is free."),
    ] = None,
    database_url: DatabaseUrl = None,
    listeners: Annotated[
        int, typer.Option(min=0, help="Simulated listeners who try each policy.")
    ] = 0,
    plays: Annotated[
        int, typer.Option(min=1, help="Plays of each of them with each policy.")
    ] = 60,
    seed: Annotated[int, typer.Option(min=0, help="Decides who they are.")] = 0,
    stop: Annotated[
        bool, typer.Option("--exit", help="Stop when all of this is done.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Start a service with a demo catalogue, and show how to use it.

    All is kept in encore-demo.db in this folder and found again the next time. With
    --listeners, simulated ones live with each policy in turn, and the table says how
    many plays they liked.
    """
    chosen = configured(host=host, port=port, database_url=database_url)
    wishes = Wishes(Trial(listeners, plays, seed), stop, as_json)
    note("Starting ...")
    opening = _open(_settings(chosen), near="port" not in chosen.model_fields_set)
    config = uvicorn.Config(
        create_app(opening.settings),
        log_config=None,
        access_log=False,
        timeout_graceful_shutdown=GRACE,
    )
    loop = config.get_loop_factory()
    with suppress(KeyboardInterrupt), asyncio.Runner(loop_factory=loop) as runner:
        runner.run(_serve(uvicorn.Server(config), opening, wishes))


def _settings(chosen: Settings) -> Settings:
    """What was chosen, and the demo's own defaults for the rest."""
    left = {k: v for k, v in DEFAULTS.items() if k not in chosen.model_fields_set}
    return chosen.with_changes(**left)


def _open(settings: Settings, *, near: bool) -> Opening:
    """Take a port, bring the database up to date, fill it, make keys."""
    listen = sockets.listen_near if near else sockets.listen
    taken = listen(settings.host, settings.port)
    bring_up_to_date(settings)
    admin_key, serve_key = perform(settings, _prepare)
    return Opening(settings, taken, admin_key, serve_key)


async def _prepare(session: Session) -> tuple[str, str]:
    """A catalogue, and new keys; the settings may name the admin key."""
    await catalogue.ensure(session.database, session.live)
    await session.database.run(partial(trial.clean_up, by=BY))
    make = partial(keys.create, name="demo", by=BY)
    _, serve_key = await session.database.run(partial(make, scope=Scope.SERVE))
    if session.settings.bootstrap_key is not None:
        return session.settings.bootstrap_key.get_secret_value(), serve_key
    _, admin_key = await session.database.run(partial(make, scope=Scope.ADMIN))
    return admin_key, serve_key


async def _serve(server: uvicorn.Server, opening: Opening, wishes: Wishes) -> None:
    serving = asyncio.create_task(server.serve([opening.socket]))
    guiding = asyncio.create_task(_guide(opening, wishes))
    await asyncio.wait({serving, guiding}, return_when=asyncio.FIRST_COMPLETED)
    if serving.done():  # interrupted, or it could not start
        guiding.cancel()
        await serving
        raise Failed("The service stopped.")
    server.should_exit = wishes.stop or guiding.exception() is not None
    await serving
    await guiding


async def _guide(opening: Opening, wishes: Wishes) -> None:
    """Wait until the service is ready, then show it."""
    url = sockets.address(opening.socket)
    async with Client(url, opening.admin_key) as client:
        await _until_ready(client)
        play = (await client.next_play(greeting.USER)).play
        invitation = Invitation(url, opening.admin_key, opening.serve_key, play)
        if not wishes.as_json:
            greeting.greet(invitation)
        lived = await _try(client, wishes.trial) if wishes.trial.listeners else []
    if wishes.as_json:
        policies = [asdict(each) for each in lived]
        show_json(greeting.describe(invitation) | {"policies": policies})
    elif lived:
        _show(lived)


async def _until_ready(client: Client) -> None:
    message = "Compiling, which takes up to a minute the first time ..."
    hint = asyncio.get_running_loop().call_later(PATIENCE, note, message)
    try:
        await client.until_ready()
    finally:
        hint.cancel()


async def _try(client: Client, wanted: Trial) -> list[Lived]:
    with progress() as bar:
        tasks = {
            policy: bar.add_task(policy, total=wanted.listeners * wanted.plays)
            for policy in wanted.policies
        }
        return [
            lived
            async for lived in trial.run(
                client, wanted, lambda policy: bar.advance(tasks[policy])
            )
        ]


def _show(lived: list[Lived]) -> None:
    show_table(
        ("policy", "like rate", "95 % interval", "plays", "decision ms"),
        [
            (
                each.policy,
                f"{each.like_rate:.3f}",
                "" if each.ci95 is None else f"± {each.ci95:.3f}",
                str(each.plays),
                "" if each.decision_ms is None else f"{each.decision_ms:.3f}",
            )
            for each in lived
        ],
    )
