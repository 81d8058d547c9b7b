"""Where a file is broken: looked for row by row, once it could not be read."""

import csv
import json
import math
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import polars as pl

from learning.reading.faults import Fault, InvalidLog
from learning.reading.sources import Format, Source

UNREADABLE = (
    pl.exceptions.PolarsError,
    pl.exceptions.PanicException,  # its Parquet reader's word for a damaged file
    OSError,
    EOFError,
    zlib.error,
    csv.Error,
    UnicodeDecodeError,
)


@contextmanager
def readable(files: Sequence[Source]) -> Iterator[None]:
    """Turn a failure to read files into an InvalidLog that says where."""
    try:
        yield
    except UNREADABLE as error:
        found = next(filter(None, map(_fault, files)), None)
        unknown = Fault("", None, None, f"cannot be read: {_first_line(error)}")
        raise InvalidLog([found or unknown]) from error


def _fault(source: Source) -> Fault | None:
    """What is wrong with the first row that is broken."""
    file, good = str(source.file), 0
    try:
        for _ in _good_rows(source):
            good += 1
    except pl.exceptions.PanicException:
        return Fault(file, None, None, "is damaged")
    except (OSError, EOFError, zlib.error, pl.exceptions.PolarsError) as error:
        return Fault(file, None, None, f"cannot be read: {_first_line(error)}")
    except UnicodeDecodeError:
        return Fault(file, good + 1, None, "is not UTF-8")
    except (csv.Error, ValueError, RecursionError) as error:
        return Fault(file, good + 1, None, f"is broken: {_first_line(error)}")
    return None


def _good_rows(source: Source) -> Iterator[object]:
    """Rows, up to one that cannot be read."""
    match source.format:
        case Format.CSV:
            yield from _csv_rows(source)
        case Format.NDJSON:
            yield from _ndjson_rows(source)
        case Format.PARQUET:
            cells = pl.scan_parquet(source.file, glob=False).null_count()
            cells.collect(engine="streaming")


def _csv_rows(source: Source) -> Iterator[object]:
    rows = csv.reader(source.lines(), strict=True)
    width = len(next(filter(None, rows), []))
    for row in rows:
        if len(row) > width:
            raise ValueError(f"{len(row)} cells, where the header has {width}")
        yield row


def _ndjson_rows(source: Source) -> Iterator[object]:
    for line in filter(str.strip, source.lines()):
        plain = json.loads(line, parse_float=_number, parse_constant=_number)
        if not isinstance(plain, dict):
            raise ValueError("no object")  # noqa: TRY004 - of the file, not of a caller
        yield plain


def _number(text: str) -> float:
    number = float(text)
    if math.isfinite(number):
        return number
    raise ValueError(f"{text} is no number of JSON")


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0]
