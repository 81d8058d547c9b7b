"""Logs written to files, as those who keep them do."""

import csv
import gzip
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import polars as pl

Row: TypeAlias = dict[str, object]


def write(file: Path, rows: Sequence[Row]) -> Path:
    """Write rows of the same fields, in the format that the name tells."""
    if ".csv" in file.name:
        return _text(file, _csv(rows))
    if ".parquet" in file.name:
        pl.DataFrame(rows, infer_schema_length=None).write_parquet(file)
        return file
    return _text(file, "".join(json.dumps(row, default=str) + "\n" for row in rows))


def _csv(rows: Sequence[Row]) -> str:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _text(file: Path, text: str) -> Path:
    plain = text.encode()
    file.write_bytes(gzip.compress(plain) if file.suffix == ".gz" else plain)
    return file
