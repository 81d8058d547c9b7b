"""`encore keys`: makes, lists and revokes keys."""

from functools import partial
from typing import Annotated

import typer

from app.cli.console import AsJson, Failed, say, show_json, show_table
from app.cli.session import DatabaseUrl, configured, perform_unit
from app.domain import Key, Scope
from app.services import keys

BY = "command line"

command = typer.Typer(no_args_is_help=True)


@command.command()
def create(
    *,
    scope: Annotated[Scope, typer.Option(help="What it allows.")] = Scope.SERVE,
    name: Annotated[str, typer.Option(help="Whose it is.")] = "",
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Make a key. Its secret is shown now, and never again."""
    settings = configured(database_url=database_url)
    work = partial(keys.create, scope=scope, name=name, by=BY)
    key, secret = perform_unit(settings, work)
    if as_json:
        show_json(_described(key) | {"key": secret})
    else:
        say(secret)


@command.command(name="list")
def show(*, database_url: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List the keys in force."""
    present = perform_unit(configured(database_url=database_url), keys.in_force)
    described = [_described(key) for key in present]
    if as_json:
        show_json(described)
    else:
        rows = [tuple(description.values()) for description in described]
        show_table(("id", "scope", "name", "created"), rows)


@command.command()
def revoke(
    key: Annotated[str, typer.Argument(help="Id of the key, as listed.")],
    *,
    database_url: DatabaseUrl = None,
) -> None:
    """End a key: within a second no process takes it any more."""
    if key.startswith("encore_"):  # as secrets do: not to be shown again
        message = "That is a secret; give the id, as 'encore keys list' shows it."
        raise Failed(message, status=2)
    work = partial(keys.revoke, key_id=key, by=BY)
    perform_unit(configured(database_url=database_url), work)
    say(f"revoked {key}")


def _described(key: Key) -> dict[str, str]:
    return {
        "id": key.id,
        "scope": key.scope.value,
        "name": key.name,
        "created_at": key.created_at.isoformat(timespec="seconds"),
    }
