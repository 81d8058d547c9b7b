"""Plays read from what Spotify gives to its listeners: one export for each person."""

import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Literal, TypeAlias
from zipfile import BadZipFile

import polars as pl

from learning.plays import Plays
from learning.reading.cells import Cell
from learning.reading.checks import Table, invalid
from learning.reading.exports import History, histories
from learning.reading.faults import Fault, InvalidLog
from learning.reading.frames import plays
from learning.reading.moments import seconds
from learning.reading.scale import LIKE_FRACTION, Scale
from learning.reading.sources import ROW

Arm: TypeAlias = Literal["artist", "track"]

SHORTEST = 45.0  # seconds: of a track never played longer, the length is not known
DONE, LEFT = "trackdone", ("fwdbtn", "backbtn")
EXTENDED = MappingProxyType(
    {
        "end": "ts",
        "played": "ms_played",
        "artist": "master_metadata_album_artist_name",
        "track": "master_metadata_track_name",
        "user": "username",
        "reason": "reason_end",
        "skipped": "skipped",
    }
)
SHORT = MappingProxyType(
    {
        **EXTENDED,
        "end": "endTime",
        "played": "msPlayed",
        "artist": "artistName",
        "track": "trackName",
    }
)
TOLD = ("user", "artist", "track", "reason", "skipped")


def read_spotify(
    exports: Iterable[Path],
    arm: Arm = "artist",
    like_fraction: float = LIKE_FRACTION,
) -> Plays:
    """Read all plays of music in exports, or none.

    A play is a like if it went on to the end of the track, and a skip if it was ended
    by hand, as far as the export tells; else a like if that share of the track was
    played, whose length is that of its longest play.

    Args:
        exports: a folder or a zip for each person, as they came; its name is that of
            the person, if the export does not tell it.
        arm: what plays and rests: an artist, or a track, named "artist - track".
        like_fraction: share of a track that is a like.

    Returns:
        Plays in order of their ends. Seconds are those at which they began, raised to
        those of the play before where they do not ascend: short exports tell ends to
        the minute. Podcasts and books are left out.

    Raises:
        InvalidLog: if anything is wrong, or there is no play.
    """
    tables = [_table(history) for history in histories(exports)]
    rows = (table.rows.select(*TOLD, **table.values) for table in tables)
    ended = pl.concat(rows).collect()
    if any(ended[role].null_count() for role in ("end", "played")):
        raise invalid(tables)
    if ended.is_empty():
        raise InvalidLog([Fault("", None, None, "there is no play of music")])
    return plays(_played(ended, arm, like_fraction), Scale())


def _table(history: History) -> Table:
    names = EXTENDED if history.extended else SHORT
    records = _records(history)
    columns = {
        name: [_text(record.get(name)) for record in records] for name in names.values()
    }
    rows = pl.LazyFrame(columns, dict.fromkeys(columns, pl.String()))
    told = {role: pl.col(names[role]) for role in TOLD}
    told["user"] = told["user"].fill_null(pl.lit(history.person))
    music = pl.col("artist").is_not_null() & pl.col("track").is_not_null()
    return Table(
        history.file,
        rows.with_row_index(ROW, 1).with_columns(**told).filter(music),
        _cells(names),
    )


def _records(history: History) -> Sequence[Mapping[str, object]]:
    content = _content(history)
    try:
        records = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise _invalid(history, None, f"is no JSON: {error}") from error
    if not isinstance(records, list):
        raise _invalid(history, None, "is no array of plays")
    for row, record in enumerate(records, 1):
        if not isinstance(record, dict):
            raise _invalid(history, row, "is no object")
    return records


def _content(history: History) -> bytes:
    try:
        return history.content()
    except (OSError, BadZipFile, zlib.error, RuntimeError) as error:
        raise _invalid(history, None, f"cannot be read: {error}") from error


def _invalid(history: History, row: int | None, message: str) -> InvalidLog:
    return InvalidLog([Fault(history.file, row, None, message)])


def _text(value: object) -> str | None:
    """A value as text; what says nothing as null."""
    if value is None or value == "":
        return None
    return str(value).encode(errors="replace").decode()


def _cells(names: Mapping[str, str]) -> Mapping[str, Cell]:
    end, played = names["end"], names["played"]
    number = pl.col(played).cast(pl.Float64, strict=False) / 1000
    length = pl.when((number >= 0) & number.is_finite()).then(number)
    return {
        "end": Cell(end, seconds(pl.col(end), pl.String()), "is no moment"),
        "played": Cell(played, length, "is no number of milliseconds"),
    }


def _played(ended: pl.DataFrame, arm: Arm, like_fraction: float) -> pl.DataFrame:
    track = pl.format("{} - {}", "artist", "track")
    return ended.select(
        user=pl.col("user").cast(pl.Categorical),
        arm=(track if arm == "track" else pl.col("artist")).cast(pl.Categorical),
        order=(pl.col("end") * 1000).cast(pl.Int64),
        time=pl.col("end") - pl.col("played"),
        answer=_liked(like_fraction).cast(pl.Int8),
    )


def _liked(like_fraction: float) -> pl.Expr:
    longest = pl.col("played").max().over("artist", "track")
    reached = (longest >= SHORTEST) & (pl.col("played") >= like_fraction * longest)
    left = pl.col("reason").is_in(LEFT) | (pl.col("skipped") == "True")
    not_done = pl.when(left).then(0).otherwise(reached.cast(pl.Int32))
    return pl.when(pl.col("reason") == DONE).then(1).otherwise(not_done)
