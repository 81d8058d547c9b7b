"""From the cells of a row to what they say of a play; null where that is wrong."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter

import polars as pl

from learning.plays import NONE
from learning.reading.columns import Columns
from learning.reading.faults import Fault, InvalidLog, shown
from learning.reading.moments import seconds
from learning.reading.scale import LIKE, Scale
from policies import NO_ANSWER

SECONDS = {"milliseconds": 0.001, "seconds": 1.0, "minutes": 60.0}
MOST_FRACTION = 10  # who rewinds plays more than there is; per cents are no shares
NO, YES = ("0", "0.0", "false", "False"), ("1", "1.0", "true", "True")
MOMENT = "is no moment like 2026-03-01T20:15:00Z; if it is a number, give the unit"


@dataclass(frozen=True, slots=True)
class Cell:
    """How a cell is read.

    Attributes:
        column: its name.
        value: what it says, null if it is wrong.
        wrong: what is wrong with it then, after the cell itself.
    """

    column: str
    value: pl.Expr
    wrong: str

    def message(self, cell: object) -> str:
        """Return what is wrong with a cell."""
        return "is missing" if cell is None else f"{shown(str(cell))} {self.wrong}"


def cells(columns: Columns, scale: Scale, types: pl.Schema) -> Mapping[str, Cell]:
    """Return how the columns of a file are read, by what they say.

    Raises:
        InvalidLog: if the signals are of another kind than the answers.
    """
    made: dict[str, Cell] = {}
    for role, column in columns.given.items():
        match role:
            case "user" | "arm":
                made[role] = _name(column)
            case "time":
                made[role] = _time(column, columns.unit, types[column])
            case "order":
                made[role] = _order(column)
            case "signal":
                made[role] = _signal(column, scale)
            case "fraction":
                made[role] = _fraction(column, scale)
            case "like":
                made[role] = _like(column, scale)
            case _:
                made[role] = _propensity(column)
    return made


def answer(read: Mapping[str, Cell]) -> pl.Expr:
    """Return the number of the signal; it counts before the share, if both are told."""
    told = [read[role] for role in ("like", "signal", "fraction") if role in read]
    first, last = told[0], told[-1]
    wrong = first.value.is_null() | last.value.is_null()
    named = pl.col(first.column).is_not_null()
    return pl.when(wrong).then(None).when(named).then(first.value).otherwise(last.value)


def _name(column: str) -> Cell:
    names = pl.col(column).cast(pl.String).cast(pl.Categorical)
    return Cell(column, names, "is no name")


def _time(column: str, unit: str | None, type_: pl.DataType) -> Cell:
    if unit is None and type_.is_numeric():
        raise InvalidLog([Fault("", None, column, "holds numbers: give their unit")])
    if unit is None:
        return Cell(column, seconds(pl.col(column), type_), MOMENT)
    number = _number(column) * SECONDS[unit]
    value = pl.when(number.is_finite()).then(number)
    return Cell(column, value, f"is no number of {unit}")


def _order(column: str) -> Cell:
    number = _number(column)
    whole = pl.when(number == number.floor()).then(number)
    exact = pl.col(column).cast(pl.String).cast(pl.Int64, strict=False)
    value = pl.coalesce(exact, whole.cast(pl.Int64, strict=False))
    return Cell(column, value, "is no whole number of 64 bits")


def _signal(column: str, scale: Scale) -> Cell:
    words = [(name,) for name in scale.signals]
    known = ", ".join((*scale.signals, NO_ANSWER))
    return _worded(column, words, f"is no signal; known are {known}")


def _like(column: str, scale: Scale) -> Cell:
    if not scale.is_of_likes:
        message = f"is a like, but the signals are {', '.join(scale.signals)}"
        raise InvalidLog([Fault("", None, column, message)])
    words = [YES if name == LIKE else NO for name in scale.signals]
    return _worded(column, words, "is neither 0 nor 1")


def _worded(column: str, words: Iterable[Sequence[str]], wrong: str) -> Cell:
    """The number of the signal that one of its words stands for."""
    word = pl.col(column).cast(pl.String)
    none = word.is_null() | (word == NO_ANSWER)
    value: pl.Expr = pl.when(none).then(pl.lit(NONE, pl.Int8))
    for number, names in enumerate(words):
        value = (
            pl.when(word.is_in(names)).then(pl.lit(number, pl.Int8)).otherwise(value)
        )
    return Cell(column, value, wrong)


def _fraction(column: str, scale: Scale) -> Cell:
    if scale.fractions is None:
        message = "is a share, but none is said to mean a signal"
        raise InvalidLog([Fault("", None, column, message)])
    share = _number(column)
    reached = pl.lit(None, pl.Int8)
    for name, least in sorted(scale.fractions.items(), key=itemgetter(1)):
        number = pl.lit(scale.signals.index(name), pl.Int8)
        reached = pl.when(share >= least).then(number).otherwise(reached)
    value = (
        pl.when(pl.col(column).is_null())
        .then(pl.lit(NONE, pl.Int8))
        .when(share.is_between(0, MOST_FRACTION))
        .then(reached)
    )
    return Cell(column, value, f"is no share from 0 to 1, or at most {MOST_FRACTION}")


def _propensity(column: str) -> Cell:
    chance = _number(column)
    value = (
        pl.when(pl.col(column).is_null())
        .then(float("nan"))
        .when((chance > 0) & (chance <= 1))
        .then(chance)
    )
    return Cell(column, value, "is no chance above 0, up to 1")


def _number(column: str) -> pl.Expr:
    return pl.col(column).cast(pl.String).cast(pl.Float64, strict=False)
