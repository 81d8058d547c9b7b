"""Catalogues that many tests use."""

import json
from pathlib import Path
from typing import Any


def paper_example(number: int) -> dict[str, Any]:
    """One of the examples of the paper, as typed and checked."""
    path = Path(__file__).parent / "policies" / "data" / f"example{number}.json"
    example: dict[str, Any] = json.loads(path.read_text())
    return example
