"""Streaming histories in what Spotify gives to its listeners: folders, or zips."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from zipfile import BadZipFile, ZipFile, is_zipfile

from learning.reading.faults import Fault, InvalidLog

EXTENDED = re.compile(r"(Streaming_History_Audio|endsong)_.*\.json")
SHORT = re.compile(r"StreamingHistory(_music_)?\d*\.json")

Contents = Mapping[str, Callable[[], bytes]]


@dataclass(frozen=True, slots=True)
class History:
    """One file of a person's plays.

    Attributes:
        person: name of the export.
        file: where it is.
        content: what it holds.
        extended: whether it is of the extended kind.
    """

    person: str
    file: str
    content: Callable[[], bytes]
    extended: bool


def histories(exports: Iterable[Path]) -> Iterator[History]:
    """Yield the histories of exports, of the extended kind where there are any.

    Args:
        exports: a folder or a zip for each person, whose name it bears; or files, in a
            folder that does.

    Raises:
        InvalidLog: if an export cannot be read, has no history, or is of two people.
    """
    homes: dict[str, Path] = {}
    for export in exports:
        home = export.resolve()
        home = home.parent if home.suffix == ".json" else home
        person = home.stem if home.is_file() else home.name
        if homes.setdefault(person, home) != home:
            raise _invalid(export, f"is a second export named {person!r}: rename one")
        yield from _histories(person, export)


def _histories(person: str, export: Path) -> Iterator[History]:
    contents = _contents(export)
    for kind in (EXTENDED, SHORT):
        found = [file for file in contents if kind.fullmatch(Path(file).name)]
        if found:
            for file in sorted(found):
                yield History(person, file, contents[file], kind is EXTENDED)
            return
    raise _invalid(export, "has no streaming history of Spotify")


def _contents(export: Path) -> Contents:
    try:
        if export.is_dir():
            return {str(file): file.read_bytes for file in export.rglob("*.json")}
        if is_zipfile(export):
            with ZipFile(export) as zipped:
                names = zipped.namelist()
            return {
                f"{export}/{name}": partial(_member, export, name) for name in names
            }
        with export.open("rb"):
            return {str(export): export.read_bytes}
    except OSError as error:
        raise _invalid(export, f"cannot be read: {error.strerror}") from error
    except BadZipFile as error:
        raise _invalid(export, f"cannot be read: {error}") from error


def _member(export: Path, name: str) -> bytes:
    with ZipFile(export) as zipped:
        return zipped.read(name)


def _invalid(export: Path, message: str) -> InvalidLog:
    return InvalidLog([Fault(str(export), None, None, message)])
