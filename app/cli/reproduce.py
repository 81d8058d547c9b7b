"""`encore reproduce`: the paper's examples, simulated anew, as tables and figures."""

import hashlib
import json
import multiprocessing
import os
import platform
import signal
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from operator import attrgetter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app import __version__
from app.cli.console import Failed, note, progress, say
from app.cli.files import make_folder
from simulation.paper import PARTS, Part, Scale

QUICK = 0.04  # of the runs
LOOK = 0.2  # seconds between two looks at how far the parts are
TELLERS = ("claims.py", "figures.py", "paper.mplstyle", "report.py")  # of numbers
FOLDERS = ("figures", "results", "tables")

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
        return {"sources": sources(), "share": self.scale.share}

    def kept(self, name: str) -> Part | None:
        """A part that was simulated before, at this scale and by this code."""
        file = self._file(name)
        if not file.exists():
            return None
        try:
            plain = json.loads(file.read_text())
            if plain["made_by"] == self.made_by:
                return Part.of(plain["part"])
        except (ValueError, LookupError, TypeError):
            note(f"{file} cannot be read: it is simulated anew.")
        else:
            note(f"{file} is of other code or another scale: it is simulated anew.")
        return None

    def keep(self, part: Part) -> None:
        """Keep a part, whole or not at all."""
        file = self._file(part.name)
        beside = file.with_suffix(".new")
        plain = {"made_by": self.made_by, "part": part.plain()}
        beside.write_text(json.dumps(plain) + "\n")
        beside.replace(file)

    def _file(self, name: str) -> Path:
        return self.folder / f"{name}.json"


@cache
def sources() -> str:
    """A digest of all code and data that simulated numbers depend on."""
    digest = hashlib.sha256()
    for package in ("policies", "simulation", "simulation.data", "simulation.paper"):
        for file in sorted(files(package).iterdir(), key=attrgetter("name")):
            if file.is_file() and file.name not in TELLERS:
                digest.update(file.read_bytes())
    return digest.hexdigest()


def command(*, out: Out = Path("paper"), quick: Quick = False) -> None:
    """Reproduce the paper: simulate its examples, judge its claims, draw its figures.

    Half an hour on two cores, two minutes with --quick. What was simulated is kept: if
    the command is stopped and called again, it goes on.
    """
    try:
        from simulation.paper import figures, report  # noqa: PLC0415 - of an extra
    except ModuleNotFoundError as error:
        message = f"{error.name} is missing: pip install '.[paper]' in a clone."
        raise Failed(message) from error
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # told to stop
    for folder in FOLDERS:
        make_folder(out / folder)
    began = time.monotonic()
    parts = parts_of(Work(Scale(QUICK) if quick else Scale(), out / "results"))
    with progress() as bar:
        drawing = bar.add_task("figures", total=len(PARTS))
        for _ in figures.draw(parts, out / "figures"):
            bar.advance(drawing)
    report.write(parts, out, _made(quick=quick))
    minutes = (time.monotonic() - began) / 60
    say(f"{out / 'report.md'}, {out / 'report.html'}, after {minutes:.1f} minutes")


def _made(*, quick: bool) -> str:
    asked = "encore reproduce --quick" if quick else "encore reproduce"
    return (
        f"Made by `{asked}` of Encore {__version__} (Python"
        f" {platform.python_version()}, NumPy {np.__version__}, {platform.machine()})."
    )


def parts_of(work: Work) -> Mapping[str, Part]:
    """All parts: those that were kept, and those that are simulated now."""
    kept = {name: part for name in PARTS if (part := work.kept(name)) is not None}
    missing = [name for name in PARTS if name not in kept]
    if missing:
        _simulate(work, missing)
    found = {name: kept.get(name) or work.kept(name) for name in PARTS}
    return {name: part for name, part in found.items() if part is not None}


def _simulate(work: Work, names: Sequence[str]) -> None:
    """Simulate parts, as many at a time as there are processors."""
    spawned = multiprocessing.get_context("spawn")
    shares = spawned.Array("d", len(names))
    processes = min(len(names), os.cpu_count() or 1)
    executor = ProcessPoolExecutor(processes, spawned, _begin, (shares,))
    try:
        interrupt = {signal.SIGINT}
        signal.pthread_sigmask(signal.SIG_BLOCK, interrupt)  # inherited: we end them
        running = {
            executor.submit(_simulate_one, work, name, place)
            for place, name in enumerate(names)
        }
        signal.pthread_sigmask(signal.SIG_UNBLOCK, interrupt)
        with progress() as bar:
            tasks = [bar.add_task(name, total=100) for name in names]
            while running:
                done, running = wait(running, LOOK)
                for task, share in zip(tasks, shares[:], strict=True):
                    bar.update(task, completed=int(100 * share))
                for future in done:
                    future.result()
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()


class _Shares:
    """How far each part is, told by the processes that simulate them."""

    of_parts: "multiprocessing.sharedctypes.SynchronizedArray[float]"


def _begin(shares: "multiprocessing.sharedctypes.SynchronizedArray[float]") -> None:
    _Shares.of_parts = shares


def _simulate_one(work: Work, name: str, place: int) -> None:
    work.keep(PARTS[name](work.scale, partial(_tell, place)))


def _tell(place: int, share: float) -> None:
    _Shares.of_parts[place] = share
