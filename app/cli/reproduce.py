"""`encore reproduce`: the paper's examples, simulated anew, as tables and figures."""

import json
import os
import platform
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.progress import Progress, TaskID

from app import __version__
from app.cli.console import Failed, note, progress, say
from simulation.paper import PARTS, Part, Scale, simulated

QUICK = 0.05  # of the runs

Out = Annotated[Path, typer.Option("--out", help="Folder to write to.")]
Quick = Annotated[
    bool, typer.Option("--quick", help="In two minutes, with wide intervals.")
]


@dataclass(frozen=True, slots=True)
class Work:
    """What is simulated, and where it is kept."""

    scale: Scale
    folder: Path

    @property
    def made_by(self) -> Mapping[str, object]:
        """What kept results must be of, to be taken."""
        return {"version": __version__, "share": self.scale.share}


def command(*, out: Out = Path("paper"), quick: Quick = False) -> None:
    """Reproduce the paper: simulate its examples, judge its claims, draw its figures.

    Half an hour on two cores, two minutes with --quick. What was simulated is kept: if
    the command is stopped and called again, it goes on.
    """
    try:
        from simulation.paper import figures, report  # noqa: PLC0415 - of an extra
    except ModuleNotFoundError as error:
        message = f"{error.name} is missing: pip install 'encore[paper]'."
        raise Failed(message) from error
    work = Work(Scale(QUICK) if quick else Scale(), out / "results")
    for folder in ("figures", "results", "tables"):
        _make(out / folder)
    parts, seconds = {}, 0.0
    with progress() as bar:
        for name in PARTS:
            parts[name], took = _part(work, name, bar)
            seconds += took
        drawing = bar.add_task("figures", total=len(PARTS))
        for _ in figures.draw(parts, out / "figures"):
            bar.advance(drawing)
    report.write(parts, out, _made(seconds, quick=quick))
    say(f"{out / 'report.md'}, {out / 'report.html'}")


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Failed(f"{folder} cannot be made: {error.strerror}.", status=2) from error


def _part(work: Work, name: str, bar: Progress) -> tuple[Part, float]:
    """A part and the seconds that it took: as it was kept, or simulated now."""
    file = work.folder / f"{name}.json"
    if file.exists():
        kept = json.loads(file.read_text())
        if kept["made_by"] == work.made_by:
            return Part.of(kept["part"]), kept["seconds"]
        note(f"{file} is of another release or scale, and simulated anew.")
    task = bar.add_task(name, total=100)
    began = time.monotonic()
    part = simulated(name, work.scale, partial(_tell, bar, task))
    seconds = time.monotonic() - began
    bar.remove_task(task)
    kept = {"made_by": work.made_by, "seconds": seconds, "part": part.plain()}
    beside = file.with_suffix(".new")
    beside.write_text(json.dumps(kept) + "\n")
    beside.replace(file)
    return part, seconds


def _tell(bar: Progress, task: TaskID, share: float) -> None:
    bar.update(task, completed=int(100 * share))


def _made(seconds: float, *, quick: bool) -> str:
    asked = "encore reproduce --quick" if quick else "encore reproduce"
    return (
        f"Made by `{asked}` of Encore {__version__} in {seconds / 60:.0f} minutes on"
        f" {os.cpu_count()} cores ({platform.machine()}, Python"
        f" {platform.python_version()}, NumPy {np.__version__})."
    )
