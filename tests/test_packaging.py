"""What a newcomer is given: a lock, a wheel, two commands, documents that are true."""

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from app import __version__
from app.cli import COMMANDS
from app.settings import Settings

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
LOCKS = {
    "requirements.lock": ("build", "otel"),
    "requirements-dev.lock": ("build", "dask", "dev", "gym", "learn", "otel", "paper"),
}
PINNED = re.compile(r"^([a-z0-9-]+)(?:\[[a-z,]+\])?==(\S+)", re.MULTILINE)
LINK = re.compile(r"\[[^\]]*\]\(([^)#]+)(?:#[^)]*)?\)")
SETTING = re.compile(r"^\| `(ENCORE_\w+)` \| (.*) \| (.*) \|$", re.MULTILINE)
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_names_no_address(lock: str) -> None:
    text = (ROOT / lock).read_text()

    assert "://" not in text
    assert "--index" not in text
    assert "--find-links" not in text


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_has_a_hash_for_everything(lock: str) -> None:
    entries = re.split(r"\n(?=[a-z])", (ROOT / lock).read_text().strip())

    for entry in entries[1:]:
        assert "--hash=sha256:" in entry, entry


@pytest.mark.parametrize(("lock", "extras"), LOCKS.items())
def test_a_lock_is_what_the_project_asks_for(lock: str, extras: tuple[str]) -> None:
    locked = pins(lock)
    optional = PROJECT["optional-dependencies"]
    wanted = [
        *PROJECT["dependencies"],
        *(r for extra in extras for r in optional[extra]),
    ]

    for requirement in map(Requirement, wanted):
        versions = locked[canonicalize_name(requirement.name)]
        assert all(requirement.specifier.contains(version) for version in versions)


def test_tests_run_on_what_is_served() -> None:
    assert pins("requirements.lock").items() <= pins("requirements-dev.lock").items()


def test_a_wheel_holds_all_that_a_service_needs(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    [wheel] = tmp_path.glob("*.whl")

    names = set(zipfile.ZipFile(wheel).namelist())

    assert wheel.name.startswith(f"encore-{__version__}-")
    kept = [
        path.relative_to(ROOT).as_posix()
        for package in ("app", "learning", "migrations", "policies", "simulation")
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    ]
    assert set(kept) <= names
    assert any(name.endswith("licenses/LICENSE") for name in names)


def test_every_setting_is_documented_as_it_is() -> None:
    documented = {
        name: (default, meaning)
        for name, default, meaning in SETTING.findall(
            (ROOT / "docs" / "settings.md").read_text()
        )
    }

    assert documented == {
        f"ENCORE_{name.upper()}": (shown(field.default), field.description)
        for name, field in Settings.model_fields.items()
    }


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_documented(name: str) -> None:
    assert f"## `encore {name}`" in (ROOT / "docs" / "cli.md").read_text()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    for target in LINK.findall(document.read_text()):
        if "://" not in target:
            assert (document.parent / target).exists(), target


def test_ci_runs_the_command_that_newcomers_are_given() -> None:
    readme = (ROOT / "README.md").read_text()
    checks = (ROOT / ".ci" / "run").read_text().strip().splitlines()

    assert "\nsh scripts/demo\n" in readme
    assert "\nsh scripts/test\n" in readme
    assert checks[-1] == "sh scripts/test"


def test_what_changes_is_written_down() -> None:
    assert "## [Unreleased]" in (ROOT / "CHANGELOG.md").read_text()


def pins(lock: str) -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for name, version in PINNED.findall((ROOT / lock).read_text()):
        found[name] = (*found.get(name, ()), version)
    return found


def shown(default: object) -> str:
    """A default as the environment would say it."""
    match default:
        case None:
            return ""
        case bool():
            return f"`{str(default).lower()}`"
        case _ if hasattr(default, "total_seconds"):
            return f"`{default.total_seconds():g}`"
        case _:
            return f"`{default}`"
