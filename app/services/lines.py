"""Files of one entry a line: what their lines are, and what is wrong with them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import IO, Generic, TypeVar

from app.errors import Fault, InvalidImport
from app.services.formats import Columns, Format, Record, records

T = TypeVar("T")
MOST_FAULTS = 100


class BadRecord(ValueError):
    """A line that is no entry of the kind asked for."""

    def __init__(self, *faults: Fault) -> None:
        super().__init__(faults)
        self.faults = faults


@dataclass(slots=True)
class Faults:
    """What is wrong with a file: the first faults, and how many there are."""

    unit: str = "line"
    first: list[tuple[int, Fault]] = field(default_factory=list)
    total: int = 0

    def add(self, number: int, *faults: Fault) -> None:
        self.total += len(faults)
        room = MOST_FAULTS - len(self.first)
        self.first.extend((number, fault) for fault in faults[:room])

    def and_those(self, others: "Faults") -> "Faults":
        """These and others, in order; neither is changed."""
        both = sorted((*self.first, *others.first), key=lambda pair: pair[0])
        return Faults(self.unit, both[:MOST_FAULTS], self.total + others.total)

    def refuse(self) -> None:
        """Refuse the file if anything is wrong with it."""
        if self.total == 0:
            return
        counted = "1 fault" if self.total == 1 else f"{self.total} faults"
        rest = self.total > MOST_FAULTS
        listed = f", of which the first {MOST_FAULTS} are listed" if rest else ""
        raise InvalidImport(
            f"The file has {counted}{listed}. Nothing was changed.",
            *(self._placed(number, fault) for number, fault in self.first),
        )

    def _placed(self, number: int, fault: Fault) -> Fault:
        place = f"{self.unit} {number}"
        name = f"{place}: {fault.field}" if fault.field else place
        return Fault(name, fault.message, fault.value)


@dataclass(frozen=True, slots=True)
class Layout(Generic[T]):
    """What the lines of a file are.

    read:    from the fields of a line to an entry, or BadRecord
    columns: of a CSV, with what makes a field of the text of a cell
    """

    read: Callable[[Record], T]
    columns: Columns


@dataclass(frozen=True, slots=True)
class LineFile(Generic[T]):
    """A file of entries, which can be read again."""

    file: IO[bytes]
    format: Format
    layout: Layout[T]

    def faults(self) -> Faults:
        """Room for what is wrong with this file."""
        return Faults("entry" if self.format.is_whole else "line")

    def entries(self, faults: Faults) -> Iterator[tuple[int, T]]:
        """Good entries by line; what is wrong with the others is added to `faults`."""
        for number, record in records(self.file, self.format, self.layout.columns):
            if isinstance(record, Fault):
                faults.add(number, record)
                continue
            try:
                entry = self.layout.read(record)
            except BadRecord as error:
                faults.add(number, *error.faults)
            else:
                yield number, entry
