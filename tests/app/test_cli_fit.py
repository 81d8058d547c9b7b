"""The command `encore fit`."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from distributed import LocalCluster

from app.cli import build
from learning import identification
from learning.chain import Chain
from learning.em import Effort
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


@pytest.mark.parametrize(
    "more",
    [
        (),
        ("--types", 2),
        ("--clock",),
        ("--samples", 3, "--types", 2),
        ("--samples", 2, "--clock"),
    ],
)
def test_what_is_learned_can_be_imported(
    encore: Encore, log: Path, tmp_path: Path, more: tuple[object, ...]
) -> None:
    database = f"sqlite:///{tmp_path / 'encore.db'}"
    out = tmp_path / "out"

    said = encore("fit", log, "--unit", "seconds", "--out", out, *QUICK, *more)

    assert said.status == 0, said.err
    assert f"{out}/models.ndjson" in said.out
    report = json.loads((out / "report.json").read_text())
    assert report["slot_s"] == (240 if "--clock" in more else None)
    assert ('PUT /v1/admin/clock {"slot_s": 240}' in said.out) == ("--clock" in more)
    models = lines(out / "models.ndjson")
    names = ["learned-1", "learned-2"] if "--types" in more else ["learned"]
    assert [model.pop("id") for model in models] == names
    for model in models:
        source = model.pop("source")
        assert source.startswith("encore fit ")
        assert source.endswith(", slots of 240 s") == ("--clock" in more)
        samples = model.pop("samples", [])
        assert Model(**model).warnings == ()
        assert len(samples) == (more[1] if "--samples" in more else 0)
        assert len({str(sample) for sample in samples}) == len(samples)
        for sample in samples:
            drawn = Model(model["states"], **sample)
            assert (np.diff(drawn.like) >= 0).all()
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
        service.put_item(item, "pop", title=f"Song {item}")
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
    titles = [item["title"] for item in lines(tmp_path / "items.ndjson")]
    assert titles == ["Song a", "Song b", "Song c"]


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
        (("FILE", "--states", "many"), "--states many: give a number"),
        (("FILE", "--states", "2-9"), "must be from 2 to 8"),
        (("FILE", "--types", "3-2"), "must be from 1 to 32"),
        (("FILE", "--unit", "seconds", "--items", "none.csv"), "none.csv"),
        (("FILE", "--samples", "9", "--states", "8"), "more than 64 in all"),
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

    words = ("fit", file, "--out", tmp_path / "out")

    said, short = encore(*words, "--clock", "--states", 2), encore(*words, "--steps", 2)

    assert said.status == 1
    assert "need the time of each play" in said.err
    assert short.status == 0


def test_states_and_types_are_chosen_on_plays_that_were_not_learned_from(
    encore: Encore, log: Path, tmp_path: Path
) -> None:
    choice = ("--states", "2-3", "--types", "1,2", "--starts", 1, "--steps", 30)

    said = encore("fit", log, "--unit", "seconds", "--out", tmp_path, *choice)

    assert said.status == 0, said.err
    told = json.loads((tmp_path / "report.json").read_text())
    tried = [(each["states"], each["types"]) for each in told["selection"]["tried"]]
    assert tried == [(2, 1), (3, 1), (told["states"], 2)]
    assert (told["states"], told["types"]) in tried
    assert told["selection"]["plays"] == pytest.approx(0.3 * told["learned"])
    assert [line.split()[-1] for line in said.out.splitlines()[1:4]].count(
        "chosen"
    ) == 1
    assert "plays, the last of each user, that were not learned from" in said.out


def test_new_items_take_after_those_of_their_tag(
    encore: Encore, tmp_path: Path
) -> None:
    """Items 0, 2 and 4 tire; the others are steady and disliked."""
    still = Chain(
        np.eye(2),
        np.eye(2),
        TRUE.observe * [[[1], [0]]] + [[[0, 0], [0.9, 0.1]]],
        TRUE.prior,
    )
    plays = sampled([TRUE, still], np.random.default_rng(2), 60, 60, 6)
    rows = zip(plays.user, plays.arm, plays.answer, strict=True)
    file, items = tmp_path / "plays.csv", tmp_path / "items.ndjson"
    told = [f"u{u},i{a},{n},{y}" for n, (u, a, y) in enumerate(rows)]
    file.write_text("\n".join(["user,item,seq,like", *told]))
    known = [
        {"id": f"i{n}", "tags": [("odd" if n % 2 else "even"), "any"]} for n in range(6)
    ]
    new = [
        {"id": "x", "model": "none", "tags": ["even"], "title": "X"},
        {"id": "y", "tags": ["any", "odd"], "payload": {"url": "/y"}, "active": False},
        {"id": "z"},
    ]
    items.write_text("\n".join(map(json.dumps, [*known, *new])))

    said = encore(
        *("fit", file, "--items", items, "--out", tmp_path / "out"),
        *(*QUICK, "--types", 2, "--json"),
    )

    assert said.status == 0, said.err
    written = lines(tmp_path / "out" / "items.ndjson")
    model = {item["id"]: item["model"] for item in written}
    assert model["x"] == model["i0"] == model["i2"] == model["i4"]
    assert model["y"] == model["i1"] == model["i3"] == model["i5"] != model["x"]
    assert written[6] == {
        "id": "x",
        "model": model["x"],
        "title": "X",
        "tags": ["even"],
    }
    assert written[7]["active"] is False
    assert written[7]["payload"] == {"url": "/y"}
    reasons = said.json["items_by_reason"]
    assert reasons == {"by_plays": 6, "by_tag": 2, "by_neither": 1}


def test_a_cluster_learns_the_same(
    encore: Encore, log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identification, "Effort", partial(Effort, steps=2))
    words = ("fit", log, "--unit", "seconds", *QUICK, "--steps", 6, "--types", 2)

    alone = encore(*words, "--out", tmp_path / "alone")
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0"
    ) as machines:
        where = ("--scheduler", machines.scheduler_address)
        beside = encore(*words, "--out", tmp_path / "beside", *where)

    assert (alone.status, beside.status) == (0, 0), beside.err
    for name in ("models.ndjson", "items.ndjson"):
        kept = [(tmp_path / place / name).read_text() for place in ("alone", "beside")]
        assert kept[0] == kept[1]


def test_a_cluster_that_is_not_there_is_told(
    encore: Encore, log: Path, tmp_path: Path
) -> None:
    said = encore("fit", log, "--scheduler", "nowhere", "--out", tmp_path)

    assert said.status == 1
    assert "The cluster of nowhere does not work: missing port" in said.err


def test_the_command_is_listed() -> None:
    assert "fit" in {command.name for command in build([]).registered_commands}
