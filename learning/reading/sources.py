"""Files of a log, by format: their columns, and their cells as text."""

import csv
import glob
import gzip
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import polars as pl

from learning.reading.columns import CANDIDATES
from learning.reading.faults import Fault, InvalidLog

ROW = "number of the row"


class Format(StrEnum):
    """How a file is written."""

    CSV = "csv"
    NDJSON = "ndjson"
    PARQUET = "parquet"


ENDINGS = {
    ".csv": Format.CSV,
    ".csv.gz": Format.CSV,
    ".jsonl": Format.NDJSON,
    ".jsonl.gz": Format.NDJSON,
    ".ndjson": Format.NDJSON,
    ".ndjson.gz": Format.NDJSON,
    ".parquet": Format.PARQUET,
}


@dataclass(frozen=True, slots=True)
class Source:
    """A file of plays."""

    file: Path
    format: Format

    def lines(self) -> Iterator[str]:
        """Yield the lines of a text."""
        packed = self.file.suffix.lower() == ".gz"
        with gzip.open(self.file) if packed else self.file.open("rb") as file:
            for line in file:
                yield line.decode("utf-8-sig")

    def names(self, given: Collection[str]) -> Sequence[str]:
        """Return the columns; of an NDJSON those with values, if known or given."""
        match self.format:
            case Format.CSV:
                return self._header()
            case Format.PARQUET:
                return pl.scan_parquet(self.file, glob=False).collect_schema().names()
            case Format.NDJSON:
                wanted = tuple(dict.fromkeys((*given, *CANDIDATES)))
                counts = self._scanned(wanted).select(pl.col(wanted).count())
                [counted] = counts.collect(engine="streaming").rows()
                return tuple(
                    name for name, count in zip(wanted, counted, strict=True) if count
                )

    def cells(self, names: Sequence[str]) -> pl.LazyFrame:
        """Return the number of each row, ROW, and those of its cells.

        A cell is as the file has it; an empty text is null.
        """
        scanned = self._scanned(names)
        types = scanned.collect_schema()
        for name in names:
            if name not in types:
                raise self._fault("is no column of this file", name)
            if types[name].is_nested() or types[name] == pl.Binary:
                raise self._fault(
                    f"holds neither text nor numbers: {types[name]}", name
                )
        cells = scanned.select(ROW, *(_cell(name, types[name]) for name in names))
        if self.format is Format.CSV:
            return cells.filter(~pl.all_horizontal(pl.col(names).is_null()))
        return cells

    def _scanned(self, names: Sequence[str]) -> pl.LazyFrame:
        match self.format:
            case Format.CSV:
                return self._csv(names)
            case Format.PARQUET:
                return pl.scan_parquet(
                    self.file, glob=False, row_index_name=ROW, row_index_offset=1
                )
            case Format.NDJSON:
                return pl.scan_ndjson(
                    glob.escape(str(self.file)),
                    schema=dict.fromkeys(names, pl.String()),
                    row_index_name=ROW,
                    row_index_offset=1,
                )

    def _csv(self, names: Sequence[str]) -> pl.LazyFrame:
        scanned = pl.scan_csv(
            self.file,
            glob=False,
            infer_schema=False,
            row_index_name=ROW,
            row_index_offset=1,
        )
        types = scanned.collect_schema()
        kept = [name for name in (ROW, *names) if name in types]
        # Polars sees a row with too many cells only where it reads all columns.
        return scanned.map_batches(
            lambda rows: rows.select(kept),
            projection_pushdown=False,
            predicate_pushdown=False,
            streamable=True,
            schema={name: types[name] for name in kept},
        )

    def _header(self) -> Sequence[str]:
        names = next(filter(None, csv.reader(self.lines())), [])
        if not names:
            raise self._fault("is empty")
        if len(set(names)) < len(names):
            raise self._fault("names a column twice")
        return names

    def _fault(self, message: str, column: str | None = None) -> InvalidLog:
        return InvalidLog([Fault(str(self.file), None, column, message)])


def sources(paths: Iterable[Path]) -> Sequence[Source]:
    """Return files and those of folders, in order of their names.

    Raises:
        InvalidLog: if there is none, or one of an unknown format.
    """
    found = [source for path in paths for source in _sources(path)]
    if not found:
        raise InvalidLog([Fault("", None, None, "there is no file")])
    return found


def _sources(path: Path) -> Iterator[Source]:
    if path.is_dir():
        within = sorted(file for file in path.rglob("*") if file.is_file())
        known = [file for file in within if _format(file) is not None]
    else:
        known = [path]
    for file in known:
        format_ = _format(file)
        if format_ is None:
            message = f"is of no known format: give {', '.join(ENDINGS)}"
            raise InvalidLog([Fault(str(file), None, None, message)])
        yield Source(file, format_)
    if not known:
        raise InvalidLog(
            [Fault(str(path), None, None, "has no file of a known format")]
        )


def _format(file: Path) -> Format | None:
    name = file.name.lower()
    found = (ENDINGS[ending] for ending in ENDINGS if name.endswith(ending))
    return next(found, None)


def _cell(name: str, type_: pl.DataType) -> pl.Expr:
    cell = pl.col(name)
    return pl.when(cell != "").then(cell).alias(name) if type_ == pl.String else cell
