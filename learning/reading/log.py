"""Plays read from files of columns."""

from collections.abc import Iterable
from pathlib import Path

import polars as pl

from learning.plays import Plays
from learning.reading.broken import readable
from learning.reading.cells import answer, cells
from learning.reading.checks import Table, invalid
from learning.reading.columns import Columns
from learning.reading.faults import Fault, InvalidLog
from learning.reading.frames import plays
from learning.reading.scale import Scale
from learning.reading.sources import Source, sources

BY_NAME = Columns()
LIKES = Scale()
KEPT = ("user", "arm", "order", "time", "propensity")


def read(
    files: Iterable[Path], columns: Columns = BY_NAME, scale: Scale = LIKES
) -> Plays:
    """Read all plays of files, or none.

    Args:
        files: CSV, NDJSON (`.ndjson`, `.jsonl`), both also with `.gz`, and Parquet; and
            folders of them. A header or the names of the fields are those of all.
        columns: what says what; left out: found by name.
        scale: the signals, and what a share means.

    Returns:
        Plays, whose users and arms are in order of their names. A user's plays are in
        that of `order` if there is one, else by time; those that are alike stay as they
        are in the files. Where the time does not ascend with `order`, it is raised to
        that of the play before.

    Raises:
        InvalidLog: if anything is wrong, or there is no play.
    """
    found = sources(files)
    with readable(found):
        given = tuple(columns.given.values())
        names = dict.fromkeys(name for file in found for name in file.names(given))
        columns = columns.found(names)
        tables = [_table(file, columns, scale) for file in found]
        frame = pl.concat(map(_plays, tables)).collect(engine="streaming")
        if any(column.null_count() for column in frame):
            raise invalid(tables)
    if frame.is_empty():
        raise InvalidLog([Fault("", None, None, "there is no play")])
    return plays(frame, scale)


def _table(source: Source, columns: Columns, scale: Scale) -> Table:
    rows = source.cells(tuple(dict.fromkeys(columns.given.values())))
    return Table(str(source.file), rows, cells(columns, scale, rows.collect_schema()))


def _plays(table: Table) -> pl.LazyFrame:
    """What rows say, null where that is wrong."""
    values = {role: value for role, value in table.values.items() if role in KEPT}
    return table.rows.select(answer=answer(table.cells), **values)
