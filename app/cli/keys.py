"""`encore keys`: makes, lists, rotates and revokes keys."""

from datetime import timedelta
from functools import partial
from typing import Annotated

import typer
from pydantic import ValidationError

from app.api.schemas.keys import LONGEST_GRACE_S, KeyForm
from app.cli.console import AsJson, Failed, say, show_json, show_table
from app.cli.session import DatabaseUrl, configured, perform_unit
from app.domain import Key, Scope
from app.services import keys

BY = "command line"
KeyId = Annotated[str, typer.Argument(help="Id of the key, as listed.")]

command = typer.Typer(no_args_is_help=True)


@command.command()
def create(
    *,
    scope: Annotated[Scope, typer.Option(help="What it allows.")] = Scope.SERVE,
    name: Annotated[str, typer.Option(help="Whose it is.")] = "",
    origin: Annotated[
        list[str] | None,
        typer.Option(help="Of pages whose scripts may use it; may be repeated."),
    ] = None,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Make a key. Its secret is shown now, and never again."""
    settings = configured(database_url=database_url)
    try:
        form = KeyForm(scope=scope, name=name or BY, origins=tuple(origin or ()))
    except ValidationError as error:
        [fault, *_] = error.errors()
        raise Failed(f"--{fault['loc'][0]}: {fault['msg']}.", status=2) from error
    make = partial(keys.create, scope=scope, name=name, by=BY, origins=form.origins)
    _show(*perform_unit(settings, make), as_json=as_json)


@command.command()
def rotate(
    key: KeyId,
    *,
    grace: Annotated[
        float,
        typer.Option(
            min=0, max=LONGEST_GRACE_S, help="Seconds for which it is good still."
        ),
    ] = 3600.0,
    database_url: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Make a key in place of one. The secret is shown now, and never again."""
    _refuse_secret(key)
    until = timedelta(seconds=grace)
    work = partial(keys.rotate, key_id=key, grace=until, by=BY)
    made = perform_unit(configured(database_url=database_url), work)
    _show(*made, as_json=as_json)


@command.command(name="list")
def show(*, database_url: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List the keys in force."""
    present = perform_unit(configured(database_url=database_url), keys.in_force)
    described = [_described(key) for key in present]
    if as_json:
        show_json(described)
    else:
        rows = [tuple(description.values()) for description in described]
        columns = ("id", "scope", "name", "created", "expires", "origins")
        show_table(columns, rows)


@command.command()
def revoke(
    key: KeyId,
    *,
    database_url: DatabaseUrl = None,
) -> None:
    """End a key: within a second no process takes it any more."""
    _refuse_secret(key)
    work = partial(keys.revoke, key_id=key, by=BY)
    perform_unit(configured(database_url=database_url), work)
    say(f"revoked {key}")


def _refuse_secret(key: str) -> None:
    if key.startswith("encore_"):  # as secrets do: not to be shown again
        message = "That is a secret; give the id, as 'encore keys list' shows it."
        raise Failed(message, status=2)


def _show(key: Key, secret: str, *, as_json: bool) -> None:
    if as_json:
        show_json(_described(key) | {"key": secret})
    else:
        say(secret)


def _described(key: Key) -> dict[str, str]:
    expires = key.expires_at
    return {
        "id": key.id,
        "scope": key.scope.value,
        "name": key.name,
        "created_at": key.created_at.isoformat(timespec="seconds"),
        "expires_at": "" if expires is None else expires.isoformat(timespec="seconds"),
        "origins": " ".join(key.origins),
    }
