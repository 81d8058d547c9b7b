"""What commands say: to people, to programs, and when they cannot go on."""

import json
from collections.abc import Sequence
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table

UNBROKEN = 500  # columns of a table that no person's window bounds

out = Console(highlight=False)
err = Console(stderr=True, highlight=False)

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]


class Failed(Exception):
    """A command cannot go on, for a reason that its caller can mend."""

    def __init__(self, message: str, status: int = 1) -> None:
        super().__init__(message)
        self.status = status


def refuse(message: str, status: int) -> int:
    """Say in one line why a command stops."""
    err.print("Error:", style="bold red", end=" ")
    err.print(message, markup=False, soft_wrap=True)
    return status


def note(message: str) -> None:
    """Say something beside what was asked for."""
    err.print(message, markup=False, soft_wrap=True)


def say(line: str = "") -> None:
    """Print a line as it is, whatever the width of the terminal."""
    out.print(line, markup=False, soft_wrap=True)


def show_json(report: object) -> None:
    say(json.dumps(report, ensure_ascii=False, indent=2, default=str))


def show_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*row)
    out.print(table, width=None if out.is_terminal else UNBROKEN)


def progress() -> Progress:
    """A bar on stderr, if that is a terminal: what is kept of output stays clean."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=err,
        transient=True,
        disable=not err.is_terminal,
    )
