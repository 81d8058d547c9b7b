"""From the bytes of a file to the fields of its entries: NDJSON, CSV, JSON, YAML."""

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import IO

from app.errors import Fault
from app.services import yaml_text
from app.services.yaml_text import NotYaml

Record = Mapping[str, object]
Records = Iterator[tuple[int, Record | Fault]]
Columns = Mapping[str, Callable[[str], object]]

LONGEST = 1_000_000
BOM = b"\xef\xbb\xbf"


class Format(StrEnum):
    """JSON and YAML are one array, read whole: for files of a few entries."""

    NDJSON = "ndjson"
    CSV = "csv"
    JSON = "json"
    YAML = "yaml"

    @property
    def is_whole(self) -> bool:
        """Whether a file is read as one, and its entries are no lines."""
        return self in {Format.JSON, Format.YAML}


class Unreadable(ValueError):
    """Bytes that are no text, or a text that is no JSON."""


def records(file: IO[bytes], format_: Format, columns: Columns) -> Records:
    """The fields of each entry, or what is wrong with it, by number."""
    file.seek(0)
    match format_:
        case Format.NDJSON:
            return _ndjson(file)
        case Format.CSV:
            return _csv(file, columns)
        case Format.JSON:
            return _whole(file, _plain)
        case Format.YAML:
            return _whole(file, _plain_yaml)


def json_object(text: str) -> Record:
    """The JSON object that a text holds."""
    plain = _plain(text)
    if isinstance(plain, dict):
        return plain
    raise Unreadable("is no JSON object")


def _plain(text: str) -> object:
    try:
        plain: object = json.loads(text)
    except RecursionError:
        raise Unreadable("is nested too deeply") from None
    except ValueError as error:
        raise Unreadable(f"is no JSON: {error}") from error
    return plain


def _plain_yaml(text: str) -> object:
    try:
        return yaml_text.load(text)
    except NotYaml as error:
        raise Unreadable(str(error)) from error


def _text(raw: bytes) -> str:
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        raise Unreadable(f"is not UTF-8 at byte {error.start + 1}") from error


def _lines(file: IO[bytes]) -> Iterator[bytes | None]:
    """Lines as they are, without the byte order mark; None: longer than is taken."""
    first = file.read(len(BOM))
    if first != BOM:
        file.seek(0)
    while raw := file.readline(LONGEST + 1):
        if len(raw) <= LONGEST or raw.endswith(b"\n"):
            yield raw
            continue
        while raw and not raw.endswith(b"\n"):
            raw = file.readline(LONGEST)
        yield None


def _line(raw: bytes | None) -> str:
    if raw is None:
        raise Unreadable(f"is longer than {LONGEST} bytes")
    return _text(raw)


def _ndjson(file: IO[bytes]) -> Records:
    for number, raw in enumerate(_lines(file), start=1):
        try:
            text = _line(raw)
            if text.strip():
                yield number, json_object(text)
        except Unreadable as error:
            yield number, Fault("", str(error))


def _csv(file: IO[bytes], columns: Columns) -> Records:
    """No row can be made out beyond one that is broken: there the file ends."""
    rows = csv.reader(map(_line, _lines(file)), strict=True)
    names: Sequence[str] = ()
    number = 1
    try:
        for row in rows:
            if row and names:
                yield number, _cells(names, row, columns)
            elif row:
                names = _header(row, columns)
            number = rows.line_num + 1
    except (csv.Error, Unreadable) as error:
        yield max(number, rows.line_num), Fault("", str(error))


def _header(row: Sequence[str], columns: Columns) -> Sequence[str]:
    names = [name.strip() for name in row]
    unknown = [name for name in names if name not in columns]
    if unknown:
        message = f"unknown column {unknown[0]!r}; known are {', '.join(columns)}"
        alone = len(row) == 1 and not {";", "\t"}.isdisjoint(row[0])
        hint = "; columns are separated by commas" if alone else ""
        raise Unreadable(message + hint)
    if len(set(names)) < len(names):
        raise Unreadable("names a column twice")
    return names


def _cells(
    names: Sequence[str], row: Sequence[str], columns: Columns
) -> Record | Fault:
    """An empty cell is a field left out."""
    if len(row) != len(names):
        return Fault("", f"has {len(row)} fields, not {len(names)}")
    record = {}
    for name, cell in zip(names, row, strict=True):
        try:
            if cell:
                record[name] = columns[name](cell)
        except ValueError as error:
            return Fault(name, str(error), cell)
    return record


def _whole(file: IO[bytes], read: Callable[[str], object]) -> Records:
    """The objects of one array, or a single object."""
    try:
        plain = read(_text(file.read().removeprefix(BOM)))
    except Unreadable as error:
        yield 1, Fault("", str(error))
        return
    for number, record in enumerate(plain if isinstance(plain, list) else [plain], 1):
        good = isinstance(record, dict)
        yield number, record if good else Fault("", "is no object")
