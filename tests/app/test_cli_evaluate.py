"""The command `encore evaluate`."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.app.commands import Encore
from tests.app.test_cli_fit import TRUE
from tests.learning.logs import sampled

QUICK = ("--states", 2, "--starts", 1, "--steps", 20)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log of 30 users, 40 plays each, of 4 items, in order."""
    plays = sampled([TRUE], np.random.default_rng(1), 30, 40, 4)
    rows = zip(plays.user, plays.arm, plays.answer, strict=True)
    lines = [f"u{u},i{a},{n},{y}" for n, (u, a, y) in enumerate(rows)]
    file = tmp_path / "plays.csv"
    file.write_text("\n".join(["user,item,seq,like", *lines]))
    return file


def test_models_stand_beside_what_is_simpler(
    encore: Encore, log: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"

    said = encore("evaluate", log, *QUICK, "--out", out, "--json")

    assert said.status == 0, said.err
    assert said.json == json.loads((out / "evaluation.json").read_text())
    scores = {score["forecaster"]: score for score in said.json["scores"]}
    assert len(scores) == 17
    assert {"chain", "chain, mood", "gradient boosting, mood"} <= scores.keys()
    assert scores["chain"]["log_loss"] < scores["user-arm rate"]["log_loss"]
    assert said.json["scores"][0]["difference"] == 0
    table = (out / "evaluation.md").read_text()
    assert all(f"| {name} |" in table for name in scores)
    for name in ("log-loss", "reliability"):
        assert (out / f"{name}.svg").stat().st_size > 1000
        with Image.open(out / f"{name}.png") as image:
            assert image.width > 1000


def test_first_plays_count_if_asked(encore: Encore, log: Path) -> None:
    few = ("--no-boosting", *QUICK, "--share", 0.05)

    repeats, every = (
        encore("evaluate", log, *few, *more, "--json").json for more in ((), ("--all",))
    )

    assert len(repeats["scores"]) == 15
    assert sum(repeats["plays"]) < sum(every["plays"]) == 30 * 38


def test_a_table_is_told(encore: Encore, log: Path) -> None:
    said = encore("evaluate", log, "--no-boosting", *QUICK)

    assert said.status == 0, said.err
    assert "chain, mood" in said.out
    assert "the last 30% of each of 30 users" in said.out


def test_nothing_to_score_is_told(encore: Encore, tmp_path: Path) -> None:
    file = tmp_path / "one.csv"
    file.write_text("user,item,seq,like\na,x,1,1\n")

    said = encore("evaluate", file, "--no-boosting")

    assert said.status == 1
    assert "hold none to score" in said.err
