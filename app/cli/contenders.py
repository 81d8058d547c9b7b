"""Policies to be compared, as options and files name them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from app.api.schemas.lines import POLICIES
from app.cli.console import Failed
from app.cli.files import opened
from app.cli.importing import refused
from app.errors import InvalidImport
from app.services import entrants
from app.services.entrants import Entrant
from app.services.formats import json_object

Policies = Annotated[
    list[str] | None,
    typer.Option(
        "--policy",
        help="A policy to try: NAME or NAME={PARAMETERS AS JSON}. Repeatable.",
        show_default=False,
    ),
]
PolicyFile = Annotated[
    Path | None,
    typer.Option(
        "--policies",
        help="Policies to try: a file of {name, params}.",
        show_default=False,
    ),
]


def entrant(text: str, discount: float) -> Entrant:
    """The policy of `--policy`."""
    name, _, given = text.partition("=")
    try:
        return entrants.entrant(name, json_object(given or "{}"), discount)
    except ValueError as error:
        raise Failed(f"--policy {name or text}: {error}.", status=2) from error


def entrants_in(file: Path, discount: float) -> Sequence[Entrant]:
    """The policies of `--policies`."""
    try:
        with opened(file, None, POLICIES) as lines:
            found = entrants.read(lines, discount)
    except InvalidImport as error:
        raise refused(error) from error
    if not found:
        raise Failed(f"--policies {file}: holds no policy.", status=2)
    return found
