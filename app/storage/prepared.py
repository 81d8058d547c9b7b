"""Statements compiled once, with what converts the values that go in and come out.

SQLAlchemy writes the SQL and knows the types. But for each execution it looks up the
statement, and makes a context, a result and rows of it: three times the time in which
SQLite answers. So what it compiled is kept, and handed to the driver.
"""

from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import sqlalchemy as sa
from sqlalchemy.sql.compiler import SQLCompiler

Params: TypeAlias = Mapping[str, object]
Columns: TypeAlias = tuple[str, ...] | None
Row: TypeAlias = Any  # a named tuple of the columns of its statement
Convert: TypeAlias = Callable[[Any], Any]
Make: TypeAlias = Callable[[Iterable[object]], Row]


class Statements:
    """The statements of an engine, each compiled when it is first met."""

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine
        self.system = engine.dialect.name
        self._known: dict[tuple[sa.Executable, Columns], Prepared] = {}

    def prepared(self, statement: sa.Executable, columns: Columns = None) -> "Prepared":
        """A statement, once a connection was made; `columns`: those to insert."""
        known = self._known.get((statement, columns))
        if known is None:
            known = Prepared(statement, self._engine.dialect, columns)
            self._known[statement, columns] = known
        return known

    def write(
        self,
        connection: sa.Connection,
        statement: sa.Executable,
        rows: Sequence[Params],
    ) -> None:
        """Do the same with the values of each row."""
        columns = tuple(rows[0]) if isinstance(statement, sa.Insert) else None
        prepared = self.prepared(statement, columns)
        if not prepared.is_fixed:
            raise TypeError(f"{statement} is another one for other values")
        values = [prepared.values(row) for row in rows]
        connection.exec_driver_sql(prepared.text, values)

    def read(self, statement: sa.Executable, params: Params) -> Sequence[Row]:
        """Read by SQLAlchemy itself, where the driver cannot, or has failed to.

        It knows what an error means, which connections it is the end of, and that a
        plan may be out of date.
        """
        with self._engine.connect() as connection:
            result = connection.execute(statement, params)
            return [*map(named(result.keys()), result)]


class Prepared:
    """A statement as a database takes it, and rows as we take them.

    is_fixed: it is the same for all values, else only SQLAlchemy can execute it
    """

    def __init__(
        self, statement: sa.Executable, dialect: sa.Dialect, columns: Columns
    ) -> None:
        if not isinstance(statement, sa.ClauseElement):
            raise TypeError(statement)
        compiled = statement.compile(dialect=dialect, column_keys=columns)
        if not isinstance(compiled, SQLCompiler):
            raise TypeError(statement)
        self.text = str(compiled)
        self.is_fixed = not compiled.post_compile_params
        self._dialect = dialect
        self._names = compiled.positiontup or []
        binds = [(name, compiled.binds[name]) for name in self._names]
        self._own = {n: bind.effective_value for n, bind in binds if not bind.required}
        self._into = [
            (place, convert)
            for place, (_, bind) in enumerate(binds)
            if (convert := bind.type.dialect_impl(dialect).bind_processor(dialect))
        ]
        selected = getattr(statement, "selected_columns", ())
        self._types = [column.type.dialect_impl(dialect) for column in selected]
        self._out: list[tuple[int, Convert]] = []
        self._make: Make | None = None

    def values(self, params: Params) -> Sequence[object]:
        """Values in the order of their places."""
        if self._own:
            params = {**self._own, **params}
        values = [params[name] for name in self._names]
        for place, convert in self._into:
            values[place] = convert(values[place])
        return tuple(values)

    def describe(self, columns: Iterable[tuple[str, object]]) -> None:
        """Take note of the names and types that the driver gives to columns."""
        told = [*columns]
        self._out = [
            (place, convert)
            for place, (kind, (_, code)) in enumerate(
                zip(self._types, told, strict=False)
            )
            if (convert := kind.result_processor(self._dialect, code))
        ]
        self._make = named(name for name, _ in told)

    @property
    def is_described(self) -> bool:
        return self._make is not None

    def rows(self, found: Iterable[Iterable[object]]) -> list[Row]:
        """Rows that the driver found, once it has described them."""
        make, out = self._make, self._out
        if make is None:
            raise RuntimeError("not described")
        rows = []
        for row in found:
            values = [*row]
            for place, convert in out:
                values[place] = convert(values[place])
            rows.append(make(values))
        return rows


def named(names: Iterable[str]) -> Make:
    """What makes rows with these names."""
    row = namedtuple("Row", [*names], rename=True)  # type: ignore[misc]  # noqa: PYI024 - their names are known only here
    return row._make
