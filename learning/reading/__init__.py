"""Logs read from files: columns of CSV, Parquet and NDJSON, and Spotify's exports.

Needs the extra `learn`.
"""

from importlib.util import find_spec

if find_spec("polars") is None:
    raise ModuleNotFoundError(
        "polars is missing: it comes with the extra `learn`", name="polars"
    )

from learning.reading.columns import Columns, Unit
from learning.reading.faults import Fault, InvalidLog
from learning.reading.log import read
from learning.reading.scale import Scale
from learning.reading.spotify import Arm, read_spotify

__all__ = [
    "Arm",
    "Columns",
    "Fault",
    "InvalidLog",
    "Scale",
    "Unit",
    "read",
    "read_spotify",
]
