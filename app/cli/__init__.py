"""The command `encore`. A module for each group of commands.

A module is imported when its command is called, so that `encore --help` need not wait
for compilers and web frameworks.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from types import MappingProxyType
from typing import Annotated

import typer

from app import __version__
from app.cli.console import Failed, refuse
from app.errors import ClientError

INTERRUPTED = 130
COMMANDS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "demo": (
            "demo",
            "Start a service with a demo catalogue, and show how to use it.",
        ),
        "serve": ("serve", "Serve requests."),
        "migrate": ("migrate", "Bring the database to this release's tables."),
        "import": ("importing", "Read models, items or a history from a file."),
        "export": ("exporting", "Write models, items or the history to a file."),
        "keys": ("keys", "Make, list and revoke keys."),
        "simulate": ("simulate", "Try policies on simulated users."),
        "bound": ("simulate", "The same: compare with what no policy can exceed."),
        "reproduce": ("reproduce", "Simulate the paper's examples; draw its figures."),
        "fit": ("fit", "Learn models from a log of plays."),
        "publish": ("publish", "Put learned models in force, if they pass the gate."),
        "evaluate": ("evaluate", "Score models on held-out plays, beside others."),
        "off-policy": (
            "off_policy",
            "Say what other policies would have earned, by a log alone.",
        ),
        "bench": ("bench", "Load a running service, and check all that it answers."),
        "audit": ("audit", "Compute all beliefs anew from the log, and compare."),
        "prune": ("prune", "Drop old plays."),
        "rebuild": ("rebuild", "Replace beliefs by what the log says."),
    }
)


def main() -> None:
    """Run a command; what its caller can mend is told in one line."""
    try:
        build(sys.argv[1:])()
    except Failed as failure:
        sys.exit(refuse(str(failure), failure.status))
    except ClientError as error:
        sys.exit(refuse(" ".join((error.detail, *_faults(error))), 1))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def _faults(error: ClientError) -> list[str]:
    """What the faults of an error say beyond its detail."""
    return [
        f"{fault.field}: {fault.message}"
        for fault in error.faults
        if fault.message != "unknown" and fault.message not in error.detail
    ]


def build(arguments: Sequence[str]) -> typer.Typer:
    """All commands, of which only the one that is called is more than its name."""
    cli = typer.Typer(
        callback=_encore,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    called = next((word for word in arguments if not word.startswith("-")), None)
    for name, (module, summary) in COMMANDS.items():
        if name == called:
            _add(cli, name, module, summary)
        else:
            cli.command(name, help=summary)(_elsewhere)
    return cli


def _add(cli: typer.Typer, name: str, module: str, summary: str) -> None:
    command = import_module(f"app.cli.{module}").command
    if isinstance(command, typer.Typer):
        cli.add_typer(command, name=name, help=summary)
    else:
        cli.command(name, short_help=summary)(command)


def _elsewhere() -> None:
    """Stand for a command that is not called."""


def _version(*, wanted: bool) -> None:
    if wanted:
        typer.echo(f"encore {__version__}")
        raise typer.Exit


def _encore(
    *,
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", callback=_version),
    ] = False,
) -> None:
    """Online recommendation for catalogues that people come back to."""
