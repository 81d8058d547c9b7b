"""What is wrong with a log, by file, row and column."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

MOST_FAULTS = 20
LONGEST = 60  # characters of a cell that are shown


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that is wrong.

    Attributes:
        file: where; empty: in no file alone.
        row: from 1, without the header: a record of a CSV, also if it spans several
            lines, and also if it is blank; a line of an NDJSON that is not blank; an
            element of a JSON array. None: in no row alone.
        column: as the file names it; None: in no column alone.
        message: what it is, as the end of a sentence that begins with the above.
    """

    file: str
    row: int | None
    column: str | None
    message: str

    def __str__(self) -> str:
        """Return one line."""
        row = None if self.row is None else f"row {self.row}"
        place = ", ".join(filter(None, (self.file, row, self.column)))
        return f"{place}: {self.message}" if place else self.message


class InvalidLog(ValueError):
    """A log of which nothing was read, because some of it cannot be.

    Attributes:
        faults: the first of them, in order.
        total: how many there are.
    """

    def __init__(self, faults: Iterable[Fault], total: int | None = None) -> None:
        self.faults: Sequence[Fault] = tuple(faults)[:MOST_FAULTS]
        self.total = len(self.faults) if total is None else total
        counted = "1 fault" if self.total == 1 else f"{self.total} faults"
        rest = self.total - len(self.faults)
        super().__init__(
            "\n".join(
                [
                    f"The log has {counted}.",
                    *map(str, self.faults),
                    *([f"And {rest} more."] if rest else []),
                ]
            )
        )


def shown(text: str) -> str:
    """Return a cell as a message quotes it."""
    return repr(text if len(text) <= LONGEST else text[:LONGEST] + "…")
