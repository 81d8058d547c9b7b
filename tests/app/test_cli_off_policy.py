"""The command `encore off-policy`."""

import json
from pathlib import Path

import pytest

from app.cli import build
from tests.app.commands import Encore
from tests.app.service import Service
from tests.catalogues import SIMPLE
from tests.learning import worlds
from tests.learning.worlds import ARMS, MODEL_OF, NAMES, TRUE, World, mostly

USERS, SLOTS = 400, 12


@pytest.fixture(scope="module")
def world() -> worlds.Played:
    myopic = worlds.myopic(TRUE)
    return World(USERS, 1).play([mostly(myopic, 0.5)] * SLOTS, worlds.round_robin)


@pytest.fixture
def log(world: worlds.Played, tmp_path: Path) -> Path:
    lines = ["user,item,seq,like,propensity"]
    lines += [
        f"u{user},{ARMS[world.arm[slot, user]]},{slot},{world.answer[slot, user]},"
        f"{float(world.chance[slot, user])}"
        for user in range(USERS)
        for slot in range(SLOTS)
    ]
    file = tmp_path / "plays.csv"
    file.write_text("\n".join(lines))
    return file


@pytest.fixture
def catalogue(tmp_path: Path) -> tuple[object, ...]:
    models = [
        {
            "id": name,
            "states": list(model.states),
            **{part: getattr(model, part).tolist() for part in ("play", "rest")},
            **{part: getattr(model, part).tolist() for part in ("like", "prior")},
        }
        for name, model in zip(NAMES, TRUE, strict=True)
    ]
    items = [{"id": arm, "model": model} for arm, model in MODEL_OF.items()]
    files = tmp_path / "models.ndjson", tmp_path / "items.ndjson"
    for file, lines in zip(files, (models, items), strict=True):
        file.write_text("\n".join(map(json.dumps, lines)))
    return "--models", files[0], "--items", files[1]


def test_what_a_policy_would_have_earned_is_what_is_true(
    encore: Encore, log: Path, world: worlds.Played, catalogue: tuple[object, ...]
) -> None:
    words = ("off-policy", log, "--policy", "round_robin", *catalogue)

    said = encore(*words, "--in-a-row", 1, "--json")
    told = encore(*words, "--in-a-row", 2)

    assert said.status == 0, said.err
    [found] = said.json["policies"]
    assert (found["policy"], found["refused"]) == ("round_robin", False)
    assert said.json["models"] == "the models given"
    answers = {each["method"]: each for each in found["report"]["answers"]}
    assert answers.pop("replay")["reason"] == "not_uniform"
    assert answers.keys() == {"ips", "snips", "dr"}
    for each in answers.values():
        estimate = each["estimate"]
        assert estimate["low"] < world.worth.mean() < estimate["high"]
        assert each["effective"] > 100
    assert told.status == 0
    assert "weighted_pdis (2)" in told.out
    assert "No replay (1): " in told.err


def test_models_are_learned_from_other_users(encore: Encore, log: Path) -> None:
    asked = ("--policy", "random", "--policy", 'epsilon={"epsilon": 0.5}')

    said = encore("off-policy", log, "--states", 2, *asked, "--json")

    assert said.status == 0, said.err
    assert said.json["models"] == "models learned from the other users"
    assert said.json["plays"] == USERS * SLOTS / 2
    assert len(said.json["policies"]) == 2


def test_the_log_of_a_service_answers_by_its_own_models(
    encore: Encore, service: Service
) -> None:
    service.put_model("pop", SIMPLE)
    for item in ("a", "b"):
        service.put_item(item, "pop")
    service.set_policy("random")
    likes = 0
    for user in range(32):
        play = service.next(f"u{user}")
        for place in range(8):
            liked = place % 3 == 0
            likes += liked
            signal = "like" if liked else "skip"
            play = service.answer(play["play"], signal, next=True)["next"]
    where = ("--database-url", service.settings.database_url)

    said = encore("off-policy", *where, "--policy", "round_robin", "--json")

    assert said.status == 0, said.err
    [found] = said.json["policies"]
    assert found["report"]["answered"] == 256
    assert found["report"]["logged"]["mean"] == pytest.approx(likes / 256)
    replay = found["report"]["answers"][0]
    assert replay["method"] == "replay"
    assert replay["estimate"]["low"] < replay["estimate"]["mean"]


def test_what_a_log_cannot_answer_is_refused(
    encore: Encore, log: Path, tmp_path: Path
) -> None:
    certain, silent = tmp_path / "certain.csv", tmp_path / "silent.csv"
    rows = [line.split(",") for line in log.read_text().splitlines()]
    certain.write_text("\n".join(",".join((*row[:4], "1")) for row in rows[1:]))
    certain.write_text(f"{','.join(rows[0])}\n{certain.read_text()}")
    silent.write_text("\n".join(",".join(row[:4]) for row in rows))
    words = ("--policy", "myopic", "--states", 2)

    refused, mute = (
        encore("off-policy", certain, *words),
        encore("off-policy", silent, *words),
    )
    plain = encore("off-policy", silent, *words, "--json")

    assert (refused.status, mute.status, plain.status) == (1, 1, 1)
    assert "deterministic_log" in refused.err
    assert "no_propensities" in mute.err
    [found] = plain.json["policies"]
    assert found["refused"] is True
    assert found["why"]["reason"] == "no_propensities"
    assert found["report"] is None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "Name a --policy"),
        (("--policy", "best"), "--policy best"),
        (("--policy", "random", "--items", "x.csv"), "--models and --items"),
        (("--policy", "random", "--clip", -1), "clip: must be above 0"),
    ],
)
def test_what_is_not_understood_is_told(
    encore: Encore, log: Path, words: tuple[object, ...], message: str
) -> None:
    said = encore("off-policy", log, *words)

    assert said.status in {1, 2}
    assert message in said.err


def test_the_command_is_listed() -> None:
    assert "off-policy" in {command.name for command in build([]).registered_commands}
