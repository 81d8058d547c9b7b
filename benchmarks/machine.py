"""What a figure was measured on."""

import os
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

LIBRARIES = ("numpy", "numba", "sqlalchemy", "fastapi", "uvicorn")


def describe(libraries: Sequence[str] = LIBRARIES) -> str:
    """Processor, Python and libraries, for the head of a table."""
    versions = ", ".join(f"{name} {version(name)}" for name in libraries)
    return (
        f"{_processor()}, {os.cpu_count()} cores, Python {platform.python_version()},"
        f" {versions}"
    )


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [line.split(":")[1].strip() for line in lines if "model name" in line]
    return names[0] if names else platform.processor()
