"""The command `encore reproduce`."""

import json
import os
import signal
import time
from pathlib import Path

import pytest

from app.cli import reproduce
from app.cli.reproduce import Work, sources
from simulation.paper import PARTS, Part, Scale
from tests.app.commands import ROOT, Encore, start

COMMITTED = ROOT / "docs" / "paper"


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """A folder with all results, as this code would have kept them."""
    results = tmp_path / "out" / "results"
    results.mkdir(parents=True)
    for name in PARTS:
        kept = json.loads((COMMITTED / "results" / f"{name}.json").read_text())
        kept["made_by"]["sources"] = sources()
        (results / f"{name}.json").write_text(json.dumps(kept))
    return tmp_path / "out"


def test_what_was_simulated_is_drawn_and_told(encore: Encore, out: Path) -> None:
    said = encore("reproduce", "--out", out)

    assert (said.status, said.err) == (0, "")
    assert said.out.startswith(f"{out}/report.md, {out}/report.html, after 0.")
    pictures = {file.name for file in (out / "figures").iterdir()}
    assert pictures == {f"{name}.{kind}" for name in PARTS for kind in ("svg", "png")}
    tables = {file.stem for file in (out / "tables").iterdir()}
    drawn = {f"{name}-instances" for name in ("structure", "example-4")}
    assert tables == {*PARTS} | drawn
    told = (out / "report.md").read_text().splitlines()[4:]
    committed = (COMMITTED / "report.md").read_text().splitlines()[4:]
    assert told == committed


def test_parts_are_simulated_in_processes_of_their_own_and_kept(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = Work(Scale(0.002), out / "results")
    monkeypatch.setattr(reproduce, "PARTS", {"horizon": PARTS["horizon"]})
    before = (out / "results" / "horizon.json").read_bytes()

    first = reproduce.parts_of(work)["horizon"]
    after = (out / "results" / "horizon.json").read_bytes()
    again = reproduce.parts_of(work)["horizon"]

    assert after != before
    assert first == again
    assert after == (out / "results" / "horizon.json").read_bytes()


def test_results_of_another_scale_are_not_taken(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    full, quick = (Work(Scale(share), out / "results") for share in (1.0, 0.05))

    assert isinstance(full.kept("items"), Part)
    assert quick.kept("items") is None
    assert "is of other code or another scale" in capsys.readouterr().err
    for broken in ("", "{", "[]", '{"made_by": 1, "part": {}}', '{"made_by": {}}'):
        (out / "results" / "items.json").write_text(broken)
        assert full.kept("items") is None
        assert "is simulated anew" in capsys.readouterr().err.replace("\n", " ")


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_at_once_with_its_processes(
    tmp_path: Path, by: signal.Signals
) -> None:
    cache = {"NUMBA_CACHE_DIR": os.environ["NUMBA_CACHE_DIR"]}
    with start("reproduce", cwd=tmp_path, extra=cache) as process:
        results = tmp_path / "paper" / "results"
        while len(children := children_of(process.pid)) < 2:
            assert process.poll() is None
            time.sleep(0.1)
        process.send_signal(by)
        try:
            out, err = process.communicate(timeout=120)
        finally:
            process.kill()

    assert (process.returncode, out, err) == (130, "", "")
    assert [*results.glob("*.new")] == []
    until = time.monotonic() + 30
    while any(map(lives, children)):
        assert time.monotonic() < until
        time.sleep(0.1)


def lives(pid: str) -> bool:
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        )
    except OSError:
        return False


def children_of(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()


def test_a_folder_that_cannot_be_made_is_told(encore: Encore, tmp_path: Path) -> None:
    (tmp_path / "file").touch()

    said = encore("reproduce", "--out", tmp_path / "file" / "paper")

    assert said.status == 2
    assert said.err.startswith("Error: ")
    assert "cannot be made" in said.err
