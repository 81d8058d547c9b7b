"""Programs that check what is deployed; `scripts/tools` fetches those of no package."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DEPLOY = ROOT / "deploy"
PLACES = (ROOT / ".tools" / "bin", Path(sys.executable).parent)


def tool(name: str) -> str:
    """Where a program is; where it need not be there, the test is left out."""
    places = os.pathsep.join([*map(str, PLACES), os.environ["PATH"]])
    found = shutil.which(name, path=places)
    if found is not None:
        return found
    reason = f"{name} is not there; `sh scripts/tools` fetches it"
    if os.environ.get("ENCORE_TOOLS") == "required":
        pytest.fail(reason)
    pytest.skip(reason)


def run(
    name: str, *words: object, cwd: Path = ROOT
) -> "subprocess.CompletedProcess[str]":
    """Run a program to its end, whatever that is."""
    return subprocess.run(
        [tool(name), *map(str, words)],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


def passes(name: str, *words: object, cwd: Path = ROOT) -> str:
    """Run a program that must succeed; what it printed."""
    ended = run(name, *words, cwd=cwd)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout
