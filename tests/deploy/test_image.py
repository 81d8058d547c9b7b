"""The image: its recipe is sound, and its first command does what it says."""

import os
import re
import shlex
import subprocess
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

from tests.deploy.tools import DEPLOY, ROOT, passes

RECIPE = (ROOT / "Dockerfile").read_text()
COPIED = [
    source
    for line in re.findall(r"^COPY (?!--from)(.*)$", RECIPE, re.MULTILINE)
    for source in shlex.split(line)[:-1]
]
PACKAGES = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"][
    "build"
]["targets"]["wheel"]["packages"]


def test_a_linter_finds_nothing() -> None:
    passes("hadolint", ROOT / "Dockerfile")


def is_sent(path: str) -> bool:
    """Whether the builder is shown a file: the last pattern that fits decides."""
    sent = True
    for pattern in (ROOT / ".dockerignore").read_text().split():
        wanted = pattern.startswith("!")
        if fits(path, pattern.removeprefix("!")):
            sent = wanted
    return sent


def fits(path: str, pattern: str) -> bool:
    parts = path.split("/")
    if pattern.startswith("**/"):
        return any(fnmatch(part, pattern.removeprefix("**/")) for part in parts)
    depth = pattern.count("/") + 1
    return fnmatch("/".join(parts[:depth]), pattern)


def test_what_is_copied_is_sent_to_the_builder() -> None:
    for source in COPIED:
        path = ROOT / source
        files = [path] if path.is_file() else [*path.rglob("*.py")]
        assert files
        for file in files:
            assert is_sent(file.relative_to(ROOT).as_posix())


def test_what_is_secret_or_large_is_not() -> None:
    for path in ("secrets/bootstrap_key", "encore.db", ".git/config", "tests/x.py"):
        assert not is_sent(path)


def test_every_package_is_copied() -> None:
    assert set(PACKAGES) <= {source.rstrip("/") for source in COPIED}


def test_it_runs_as_nobody() -> None:
    users = re.findall(r"^USER (.*)$", RECIPE, re.MULTILINE)
    last = RECIPE.rindex("\nFROM ")

    assert users == ["65534:65534"]
    assert RECIPE.index("\nUSER ") > last
    assert 'ENTRYPOINT ["encore-entrypoint"]' in RECIPE[last:]
    assert "HEALTHCHECK" in RECIPE[last:]


@pytest.fixture
def compiled(tmp_path: Path) -> Path:
    folder = tmp_path / "compiled" / "policies_1"
    folder.mkdir(parents=True)
    (folder / "tree.nbi").write_text("index")
    return folder.parent


def enter(compiled: Path, cache: Path, *command: str, **more: str) -> str:
    """Run a command as the image does."""
    surroundings = {
        "PATH": os.environ["PATH"],
        "ENCORE_COMPILED": str(compiled),
        "NUMBA_CACHE_DIR": str(cache),
        **more,
    }
    ended = subprocess.run(
        ["sh", DEPLOY / "entrypoint.sh", *command],
        env=surroundings,
        check=True,
        capture_output=True,
        text=True,
    )
    return ended.stdout


def test_compiled_code_is_found_where_it_may_be_added_to(
    compiled: Path, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"

    said = enter(compiled, cache, "sh", "-c", "echo $NUMBA_CACHE_DIR; echo $0 $$")

    index = cache / "policies_1" / "tree.nbi"
    assert said.splitlines()[0] == str(cache)
    assert index.is_symlink()
    assert index.read_text() == "index"
    (cache / "policies_1" / "new.nbi").touch()
    assert not (compiled / "policies_1" / "new.nbi").exists()


def test_what_was_compiled_since_is_kept(compiled: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()

    enter(compiled, cache, "true")

    assert list(cache.iterdir()) == []


def test_the_command_takes_the_place_of_the_script(
    compiled: Path, tmp_path: Path
) -> None:
    said = enter(compiled, tmp_path / "cache", "sh", "-c", "cat /proc/$$/cmdline")

    assert "entrypoint" not in said


def test_an_operator_may_name_the_processor(compiled: Path, tmp_path: Path) -> None:
    named = {"NUMBA_CPU_NAME": "znver4", "NUMBA_CPU_FEATURES": "+avx2"}

    said = enter(compiled, tmp_path / "cache", "env", **named)

    assert {f"{name}={value}" for name, value in named.items()} <= {*said.splitlines()}
