"""Files that are imported, by the format that their names tell."""

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TypeVar

from app.cli.console import Failed
from app.services.formats import Format
from app.services.lines import Layout, LineFile

T = TypeVar("T")
STDIN = Path("-")
FORMATS = {
    ".csv": Format.CSV,
    ".json": Format.JSON,
    ".jsonl": Format.NDJSON,
    ".ndjson": Format.NDJSON,
    ".yaml": Format.YAML,
    ".yml": Format.YAML,
}


@contextmanager
def opened(
    file: Path, format_: Format | None, layout: Layout[T]
) -> Iterator[LineFile[T]]:
    """A file that can be read twice, as an import needs it."""
    named = format_ or _format_of(file)
    if named is Format.CSV and not layout.columns:
        message = f"{file} cannot be read as CSV; give NDJSON, JSON or YAML."
        raise Failed(message, status=2)
    if file == STDIN:
        with TemporaryFile() as kept:
            shutil.copyfileobj(sys.stdin.buffer, kept)
            yield LineFile(kept, named, layout)
    else:
        with _open(file) as found:
            yield LineFile(found, named, layout)


def _format_of(file: Path) -> Format:
    if file == STDIN:
        return Format.NDJSON
    try:
        return FORMATS[file.suffix.lower()]
    except KeyError:
        endings = ", ".join(FORMATS)
        message = f"{file} does not end in {endings}: say its --format."
        raise Failed(message, status=2) from None


def _open(file: Path) -> IO[bytes]:
    try:
        return file.open("rb")
    except OSError as error:
        raise Failed(f"{file} cannot be read: {error.strerror}.", status=2) from error


def make_folder(folder: Path) -> None:
    """Make a folder to write to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Failed(f"{folder} cannot be made: {error.strerror}.", status=2) from error
