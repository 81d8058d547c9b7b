"""Rows whose cells are wrong, found among the others."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import polars as pl

from learning.reading.cells import Cell
from learning.reading.faults import MOST_FAULTS, Fault, InvalidLog
from learning.reading.sources import ROW


@dataclass(frozen=True, slots=True)
class Table:
    """The rows of a file, and how their cells are read.

    Attributes:
        file: its name.
        rows: cells as they are, and ROW.
        cells: by what they say.
    """

    file: str
    rows: pl.LazyFrame
    cells: Mapping[str, Cell]

    @property
    def values(self) -> Mapping[str, pl.Expr]:
        """Return what the cells say: null where that is wrong."""
        return {role: cell.value for role, cell in self.cells.items()}

    def total(self) -> int:
        """Return how many cells are wrong."""
        wrong = self.rows.select(pl.sum_horizontal(each.sum() for each in self._wrong))
        return int(wrong.collect(engine="streaming").item())

    def faults(self) -> Iterator[Fault]:
        """Yield what is wrong with the first rows in error."""
        rows = self.rows.with_columns(self._wrong)
        wrong = rows.filter(pl.any_horizontal(self._wrong)).head(MOST_FAULTS)
        for row in wrong.collect(engine="streaming").rows(named=True):
            for role, cell in self.cells.items():
                if row[_flag(role)]:
                    message = cell.message(row[cell.column])
                    yield Fault(self.file, row[ROW], cell.column, message)

    @property
    def _wrong(self) -> Sequence[pl.Expr]:
        return [
            value.is_null().alias(_flag(role)) for role, value in self.values.items()
        ]


def invalid(tables: Iterable[Table]) -> InvalidLog:
    """Return all that is wrong: the first faults, and their number."""
    first: list[Fault] = []
    total = 0
    for table in tables:
        total += table.total()
        if len(first) < MOST_FAULTS:
            first.extend(table.faults())
    return InvalidLog(first, total)


def _flag(role: str) -> str:
    return f"{role} is wrong"
