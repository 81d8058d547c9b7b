"""The command `encore fit`."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.cli import build
from learning.chain import Chain
from policies import Model
from tests.app.commands import Encore
from tests.app.service import Service
from tests.catalogues import SERIES, SIMPLE
from tests.learning.logs import sampled

QUICK = ("--states", 2, "--starts", 1, "--steps", 30)
TRUE = Chain(
    np.array([[0.8, 0.2], [0.5, 0.5]]),
    np.array([[0.6, 0.4], [0.1, 0.9]]),
    np.array([[[0.9, 0.1], [0.2, 0.8]]]),
    np.array([0.5, 0.5]),
)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log of 40 users, 40 plays each, of 4 items, with times."""
    plays = sampled([TRUE], np.random.default_rng(1), 40, 40, 4)
    lines = ["user,item,time,like"]
    lines += [
        f"u{user},i{arm},{240 * place},{answer}"
        for place, (user, arm, answer) in enumerate(
            zip(plays.user, plays.arm, plays.answer, strict=True)
        )
    ]
    file = tmp_path / "plays.csv"
    file.write_text("\n".join(lines))
    return file


def lines(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text().splitlines()]


@pytest.mark.parametrize("more", [(), ("--types", 2), ("--clock",)])
def test_what_is_learned_can_be_imported(
    encore: Encore, log: Path, tmp_path: Path, more: tuple[object, ...]
) -> None:
    database = f"sqlite:///{tmp_path / 'encore.db'}"
    out = tmp_path / "out"

    said = encore("fit", log, "--unit", "seconds", "--out", out, *QUICK, *more)

    assert said.status == 0, said.err
    assert f"{out}/models.ndjson" in said.out
    models = lines(out / "models.ndjson")
    names = ["learned-1", "learned-2"] if "--types" in more else ["learned"]
    assert [model.pop("id") for model in models] == names
    for model in models:
        assert model.pop("source").startswith("encore fit ")
        assert Model(**model).warnings == ()
    encore("migrate", "--database-url", database)
    for what in ("models", "items"):
        file = out / f"{what}.ndjson"
        imported = encore("import", what, file, "--database-url", database)
        assert imported.status == 0, imported.err
    items = [item["id"] for item in lines(out / "items.ndjson")]
    assert items == ["i0", "i1", "i2", "i3"]


def test_the_report_is_for_programs_and_the_same_again(
    encore: Encore, log: Path, tmp_path: Path
) -> None:
    words = ("fit", log, "--unit", "seconds", "--draws", 3, *QUICK, "--json")

    told, again = (
        encore(*words, "--out", tmp_path / name).json for name in ("one", "other")
    )

    kept = json.loads((tmp_path / "one" / "report.json").read_text())
    assert kept == told
    assert told.pop("seconds") > 0
    assert again.pop("seconds") > 0
    assert told.pop("made_at") < again.pop("made_at")
    assert told == again
    assert (told["plays"], told["answered"]) == (1600, 1600)
    assert (told["users"], told["items"]) == (40, 4)
    assert told["items_by_model"] == [4]
    assert {bond["bond"] for bond in told["identification"]["bonds"]} == {
        "rest",
        "play",
        "same",
    }
    low, high = np.array(told["intervals"]["observe"])
    assert (low <= high).all()


def test_it_learns_from_the_plays_of_a_service(
    encore: Encore, service: Service, tmp_path: Path
) -> None:
    service.put_model("pop", SIMPLE)
    for item in ("a", "b", "c"):
        service.put_item(item, "pop")
    expected = []
    for user in ("ann", "bob"):
        for place in range(6):
            play = service.client.get(f"/v1/users/{user}/next").json()["play"]
            answer = {"signal": ("like", "skip", "none")[place % 3]}
            told = service.client.post(f"/v1/plays/{play}/feedback", json=answer)
            expected.append(told.json()["signal"])

    said = encore(
        *("fit", "--database-url", service.settings.database_url, "--out", tmp_path),
        *(*QUICK, "--json"),
    )

    assert said.status == 0, said.err
    assert said.json["plays"] == len(expected) == 12
    assert said.json["answered"] == 8
    assert said.json["users"] == 2
    [model] = lines(tmp_path / "models.ndjson")
    assert model["like"] == sorted(model["like"])


def test_models_that_are_answered_otherwise_are_not_learned_together(
    encore: Encore, service: Service, tmp_path: Path
) -> None:
    service.put_model("pop", SIMPLE)
    words = ("fit", "--database-url", service.settings.database_url, "--out", tmp_path)

    empty = encore(*words)
    service.put_model("series", SERIES)
    mixed = encore(*words)

    assert (empty.status, mixed.status) == (1, 1)
    assert "There is no play" in empty.err
    assert "'pop' and 'series' have different signals" in mixed.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--user", "who"), "--user goes with files"),
        (("--spotify", "artist"), "--spotify goes with files"),
        (("FILE", "--database-url", "sqlite:///x"), "does not go with files"),
        (("FILE", "--spotify", "track", "--arm", "item"), "does not go with --arm"),
        (("FILE",), "unit"),
        (("FILE", "--unit", "seconds", "--like", "mood"), "mood"),
        (("missing.csv",), "missing.csv"),
    ],
)
def test_what_cannot_be_read_is_told(
    encore: Encore, log: Path, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    given = [log if word == "FILE" else word for word in words]

    said = encore("fit", *given, "--out", tmp_path / "out")

    assert said.status == 2
    assert said.err.startswith("Error: ")
    assert message in said.err
    assert not (tmp_path / "out" / "models.ndjson").exists()


def test_rests_by_the_clock_need_times(encore: Encore, tmp_path: Path) -> None:
    file = tmp_path / "plays.csv"
    file.write_text("user,item,order,like\na,x,1,1\na,x,2,0\n")

    said = encore("fit", file, "--clock", "--out", tmp_path / "out")

    assert said.status == 1
    assert "need the time of each play" in said.err


def test_the_command_is_listed() -> None:
    assert "fit" in {command.name for command in build([]).registered_commands}
