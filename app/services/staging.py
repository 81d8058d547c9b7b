"""Entries that were found good, aside in a temporary file until they are written."""

import json
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from tempfile import TemporaryFile
from types import TracebackType
from typing import IO, Generic, Self, TypeVar

T = TypeVar("T")
Row = Sequence[object]


@dataclass(slots=True)
class Staging(Generic[T]):
    """Entries by line, as many as there may be; read as often as needed.

    fields: what of an entry is kept
    make:   an entry of these fields
    """

    fields: tuple[str, ...]
    make: Callable[..., T]
    lines: "array[int]" = field(default_factory=lambda: array("q"))
    places: "array[int]" = field(default_factory=lambda: array("q"))
    _file: IO[bytes] = field(default_factory=TemporaryFile)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()

    def __len__(self) -> int:
        return len(self.lines)

    def __iter__(self) -> Iterator[T]:
        self._file.seek(0)
        for raw in self._file:
            yield self.make(*json.loads(raw))

    def __getitem__(self, number: int) -> T:
        self._file.seek(self.places[number])
        return self.make(*json.loads(self._file.readline()))

    def add(self, line: int, entry: T) -> None:
        """Stage an entry; all are added before any is read."""
        self.lines.append(line)
        self.places.append(self._file.tell())
        row = attrgetter(*self.fields)(entry)
        self._file.write(json.dumps(row).encode() + b"\n")
