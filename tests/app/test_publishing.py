"""Learned models go live through the gate, all at once, and are taken back."""

import asyncio
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.domain import ItemModel
from app.services.candidates import digest_of
from app.services.gate import chain_of
from app.services.logs import log
from app.storage import models
from app.storage.database import Database
from learning import Plays
from learning.chain import Chain
from learning.prediction import predicted
from tests.app.commands import Encore, Said
from tests.app.replays import taken_again
from tests.app.service import ADMIN, Service, client_of
from tests.learning.logs import sampled

USERS, PLAYS, ITEMS = 30, 110, 4
BEGAN = datetime.now(UTC) - timedelta(days=30)
TRUE = Chain(  # a play tires, rest restores
    np.array([[0.9, 0.1], [0.8, 0.2]]),
    np.array([[0.6, 0.4], [0.05, 0.95]]),
    np.array([[[0.9, 0.1], [0.15, 0.85]]]),
    np.array([0.2, 0.8]),
)
FIRST: dict[str, Any] = {  # what somebody guessed
    "states": ["low", "high"],
    "play": [[0.8, 0.2], [0.2, 0.8]],
    "rest": [[0.9, 0.1], [0.1, 0.9]],
    "like": [0.3, 0.7],
    "prior": [0.5, 0.5],
}
QUICK = ("--states", 2, "--starts", 1, "--steps", 60)


@pytest.fixture
def grown(encore: Encore, service: Service, tmp_path: Path) -> Service:
    """A service of guessed models, whose users have played for a month."""
    for name in ("guess", "other"):
        service.put_model(name, FIRST)
    for item in range(ITEMS):
        service.put_item(f"item-{item}", "guess", tags=[f"tag-{item}"])
    service.put_item("unplayed", "other")
    service.set_policy("whittle")
    plays = sampled([TRUE], np.random.default_rng(7), USERS, PLAYS, ITEMS)
    lines = [
        json.dumps(
            {
                "user": f"user-{user}",
                "item": f"item-{arm}",
                "signal": ("skip", "like")[answer],
                "at": (BEGAN + timedelta(minutes=5 * number)).isoformat(),
            }
        )
        for user, arm, answer, number in zip(
            plays.user, plays.arm, plays.answer, plays.number.tolist(), strict=True
        )
    ]
    file = tmp_path / "history.ndjson"
    file.write_text("\n".join(lines))
    at = ("--database-url", service.settings.database_url)
    entered = encore("import", "history", file, *at)
    assert entered.status == 0, entered.err
    return service


def fitted(encore: Encore, service: Service, folder: Path, *more: object) -> Path:
    at = ("--database-url", service.settings.database_url)
    learned = encore("fit", "--out", folder, *QUICK, *more, *at)
    assert learned.status == 0, learned.err
    return folder


def publish(encore: Encore, service: Service, folder: Path, *more: object) -> Said:
    at = ("--database-url", service.settings.database_url)
    return encore("publish", folder, "--json", *more, *at)


def rewritten(folder: Path, **fields: object) -> None:
    """Another model in a candidate, as if it had been learned."""
    file = folder / "models.ndjson"
    file.write_text(json.dumps(json.loads(file.read_text()) | fields) + "\n")
    report = folder / "report.json"
    told = json.loads(report.read_text()) | {"digest": digest_of(folder)}
    report.write_text(json.dumps(told))


def what_is_there(service: Service) -> dict[str, Any]:
    """Chances of models in force, and which item follows which."""
    models = service.client.get("/v1/models").json()["models"]
    items = service.client.get("/v1/items").json()["items"]
    parts = ("play", "rest", "like", "prior", "states")
    return {
        "models": {each["id"]: [each[part] for part in parts] for each in models},
        "items": {each["id"]: (each["model"], each["tags"]) for each in items},
    }


def audited(encore: Encore, service: Service) -> dict[str, Any]:
    said = encore("audit", "--json", "--database-url", service.settings.database_url)
    report: dict[str, Any] = said.json
    assert said.status == 0, report
    return report


@contextmanager
def listening(service: Service, users: int) -> Iterator[list[dict[str, Any]]]:
    """Users who play and answer all the while; their plays, as they were offered."""
    offered: list[dict[str, Any]] = []
    failed: list[BaseException] = []
    done = threading.Event()

    def listen(user: str, seed: int) -> None:
        luck = np.random.default_rng(seed)
        try:
            with client_of(service.url, ADMIN) as client:
                while not done.is_set():
                    play = client.get(f"/v1/users/{user}/next").raise_for_status()
                    offered.append(play.json())
                    signal = "like" if luck.random() < 0.5 else "skip"
                    answer = {"signal": signal}
                    path = f"/v1/plays/{play.json()['play']}/feedback"
                    client.post(path, json=answer).raise_for_status()
        except BaseException as error:
            failed.append(error)
            raise

    threads = [
        threading.Thread(target=listen, args=(f"user-{user}", user))
        for user in range(users)
    ]
    for thread in threads:
        thread.start()
    try:
        yield offered
    finally:
        done.set()
        for thread in threads:
            thread.join()
    assert not failed


def test_a_good_candidate_goes_live_and_is_taken_back_in_one_call(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    before = what_is_there(grown)
    folder = fitted(encore, grown, tmp_path / "fitted")

    tried = publish(encore, grown, folder, "--dry-run")
    assert tried.json["passed"], tried.json
    assert tried.json["publication"] is None
    assert what_is_there(grown) == before

    said = publish(encore, grown, folder, "--note", "nightly")

    assert said.status == 0, said.out
    scores = said.json["scores"]
    losses = {name: score["log_loss"] for name, score in scores.items()}
    assert losses["candidate"] < losses["present"]
    assert losses["candidate"] < losses["rate"]
    there = what_is_there(grown)
    learned = json.loads((folder / "models.ndjson").read_text())
    assert there["models"]["learned"][0] == learned["play"]
    assert there["items"] == {
        **{f"item-{n}": ("learned", [f"tag-{n}"]) for n in range(ITEMS)},
        "unplayed": ("other", []),
    }
    assert audited(encore, grown)["stale"] == 0
    [listed] = grown.client.get("/v1/admin/publications").json()["publications"]
    assert (listed["number"], listed["models"]) == (1, {"learned": 1})
    assert [listed[key] for key in ("items", "note", "by")] == [
        4,
        "nightly",
        "command line",
    ]
    assert listed["verdict"]["checks"] == said.json["checks"]
    table = grown.client.get("/v1/models/learned/index").json()
    assert (table["precision"], table["indexable"]) == ("full", True)

    back = grown.client.post("/v1/admin/publications/rollback", json={"note": "no"})

    assert back.status_code == 200, back.text
    assert (back.json()["items"], back.json()["kept"]) == (4, [])
    assert back.json()["publication"]["undone_at"] is not None
    assert what_is_there(grown) == before
    grown.answer(grown.next("user-0")["play"], "like")
    audited(encore, grown)
    again = grown.client.post("/v1/admin/publications/rollback")
    assert (again.status_code, again.json()["code"]) == (409, "no_publication")


def test_samples_go_live_under_a_policy_that_draws_them(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    folder = fitted(encore, grown, tmp_path / "fitted", "--samples", 3)
    before = what_is_there(grown)

    early = publish(encore, grown, folder)

    assert early.status == 1
    [failed] = [check for check in early.json["checks"] if not check["passed"]]
    assert failed["name"] == "policy"
    assert "thompson" in failed["detail"]

    grown.set_policy("thompson", policy={"name": "whittle"})
    said = publish(encore, grown, folder)

    assert said.status == 0, said.json
    shown = grown.client.get("/v1/models/learned").json()
    assert len(shown["samples"]) == 3
    played = []
    for _ in range(4):
        play = grown.next("user-0")
        played.append((play["play"], (play["item"], play["like"], play["propensity"])))
        grown.answer(play["play"], "skip")
    assert taken_again(grown, [play for play, _ in played]) == played
    assert audited(encore, grown)["stale"] < USERS
    back = grown.client.post("/v1/admin/publications/rollback")
    assert back.status_code == 200, back.text
    assert what_is_there(grown) == before
    audited(encore, grown)


def test_a_wrong_candidate_stays_out(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    folder = fitted(encore, grown, tmp_path / "fitted")
    rewritten(folder, rest=[[0.95, 0.05], [0.4, 0.6]], play=[[0.2, 0.8], [0.1, 0.9]])
    before = what_is_there(grown)

    said = publish(encore, grown, folder)

    assert said.status == 1
    assert "does not pass the gate" in said.err
    failed = [check["name"] for check in said.json["checks"] if not check["passed"]]
    assert failed == ["not worse than present", "not worse than rate"]
    assert what_is_there(grown) == before
    assert grown.client.get("/v1/admin/publications").json()["publications"] == []


@pytest.mark.parametrize(
    ("until", "reason"),
    [(timedelta(days=29, hours=23), "evidence"), (timedelta(0), None)],
)
def test_it_takes_enough_plays_that_nothing_was_learned_from(
    encore: Encore, grown: Service, tmp_path: Path, until: timedelta, reason: str | None
) -> None:
    folder = fitted(encore, grown, tmp_path / "fitted")
    report = folder / "report.json"
    moment = (BEGAN + until).isoformat()
    told = json.loads(report.read_text()) | {"learned_until": moment}
    report.write_text(json.dumps(told))

    said = publish(encore, grown, folder, "--dry-run")

    failed = [check["name"] for check in said.json["checks"] if not check["passed"]]
    assert failed == ([] if reason is None else [reason])
    assert (said.status == 0) is (reason is None)


def test_models_by_the_clock_go_live_under_that_clock_alone(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    at = ("--database-url", grown.settings.database_url)
    folder = tmp_path / "fitted"
    words = ("--clock", "--slot-s", 300, *QUICK, *at)
    learned = encore("fit", "--out", folder, *words)
    assert learned.status == 0, learned.err

    early = publish(encore, grown, folder)
    grown.client.put("/v1/admin/clock", json={"slot_s": 300}).raise_for_status()
    said = publish(encore, grown, folder)

    failed = [check["name"] for check in early.json["checks"] if not check["passed"]]
    assert (early.status, failed) == (1, ["clock"])
    assert said.status == 0, said.out
    scores = said.json["scores"]
    assert scores["candidate"]["log_loss"] < scores["rate"]["log_loss"]
    audited(encore, grown)


def test_what_was_changed_after_learning_is_no_candidate(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    folder = fitted(encore, grown, tmp_path / "fitted")
    with (folder / "items.ndjson").open("a") as file:
        file.write('{"id": "unplayed", "model": "learned"}\n')

    said = publish(encore, grown, folder)

    assert said.status == 2
    assert "learn anew" in said.err


@pytest.mark.parametrize("name", ["models.ndjson", "items.ndjson", "report.json"])
def test_a_file_that_lacks_is_named(
    encore: Encore, service: Service, tmp_path: Path, name: str
) -> None:
    for file in {"models.ndjson", "items.ndjson", "report.json"} - {name}:
        (tmp_path / file).write_text("{}")

    said = publish(encore, service, tmp_path)

    assert said.status == 2
    assert name in said.err


def test_what_others_changed_since_stays(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    folder = fitted(encore, grown, tmp_path / "fitted")
    assert publish(encore, grown, folder).status == 0
    grown.put_item("item-0", "other", tags=["mine"])
    grown.put_item("new", "learned")

    back = grown.client.post("/v1/admin/publications/rollback").json()

    assert (back["items"], back["kept"]) == (3, ["learned"])
    items = what_is_there(grown)["items"]
    assert items["item-0"] == ("other", ["mine"])
    assert items["item-1"] == ("guess", ["tag-1"])
    assert items["new"] == ("learned", [])


def test_a_second_publication_makes_new_versions_and_goes_back_step_by_step(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    folder = fitted(encore, grown, tmp_path / "fitted")
    start = what_is_there(grown)
    assert publish(encore, grown, folder).status == 0
    first = what_is_there(grown)
    again = publish(encore, grown, folder)
    assert (again.status, "in force already" in again.err) == (1, True)
    rewritten(folder, prior=[0.25, 0.75])
    assert publish(encore, grown, folder, "--margin", 0.1).status == 0
    [latest, _] = grown.client.get("/v1/admin/publications").json()["publications"]
    assert (latest["models"], latest["items"]) == ({"learned": 2}, 0)

    for expected in (first, start):
        grown.client.post("/v1/admin/publications/rollback").raise_for_status()
        assert what_is_there(grown) == expected
    audited(encore, grown)


def test_models_are_exchanged_under_users_who_play_on(
    encore: Encore, grown: Service, tmp_path: Path
) -> None:
    """No belief of one version meets a model of another; each play proves it."""
    folder = fitted(encore, grown, tmp_path / "fitted")

    with listening(grown, 4) as offered:
        for _ in range(2):
            seen = len(offered)
            said = publish(encore, grown, folder, "--margin", 1)
            assert said.status == 0, said.out
            back = grown.client.post("/v1/admin/publications/rollback")
            assert back.is_success, back.text
            until = time.monotonic() + 60
            while len(offered) < seen + 40 and time.monotonic() < until:
                time.sleep(0.01)

    assert audited(encore, grown)["plays"] > USERS * PLAYS + 80
    again = taken_again(grown, [play["play"] for play in offered])
    for shown, taken in zip(offered, again, strict=True):
        assert taken[1] == (shown["item"], shown["like"], shown["propensity"])


def test_the_gate_foretells_what_the_service_foretold(grown: Service) -> None:
    luck = np.random.default_rng(3)
    offered = []
    for _ in range(6):
        for user in ("user-0", "user-1", "newcomer"):
            offered.append(grown.next(user))
            signal = ("like", "skip", "none")[luck.integers(3)]
            grown.answer(offered[-1]["play"], signal)

    async def logged() -> tuple[Plays, list[ItemModel]]:
        database = Database(grown.settings)
        try:
            return await log(database), [
                model
                for name in ("guess", "other")
                if (model := await database.run(partial(models.latest, model=name)))
            ]
        finally:
            await database.close()

    plays, there = asyncio.run(logged())
    kind = np.array([int(arm == "unplayed") for arm in plays.arms])
    chances = predicted(plays, [*map(chain_of, there)], kind)[:, 1]

    for user in ("user-0", "user-1", "newcomer"):
        shown = [play["like"] for play in offered if play["user"] == user]
        own = chances[plays.user == plays.users.index(user)][-len(shown) :]
        np.testing.assert_allclose(own, shown, atol=1e-12)
