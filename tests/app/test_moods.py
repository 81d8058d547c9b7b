"""Models with a mood, over HTTP: the user's last answers change what is expected."""

import json
import random
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from policies import LIKED, Mood
from tests.app.commands import Encore
from tests.app.replays import taken_again
from tests.app.service import Service
from tests.app.test_audits import audit, rebuild
from tests.catalogues import SERIES, SIMPLE
from tests.filter import Filter, chances
from tests.policies.oracles import Feeling

RULE = Mood(answers=1, memory=3.0, levels=(0.5,), pause_s=60.0)
GIVEN: dict[str, Any] = {"answers": 1, "memory": 3, "levels": [0.5], "pause_s": 60}
MANY = GIVEN | {"answers": 4, "levels": [0.3, 0.6]}
DRAWN = np.random.default_rng(1)


def with_mood(model: Mapping[str, Any], name: str, by_mood: object) -> dict[str, Any]:
    rest = {field: value for field, value in model.items() if field != name}
    return {**rest, "mood": {**GIVEN, name: by_mood}}


SONG = with_mood(SIMPLE, "like", DRAWN.random((RULE.classes, 2)).tolist())
MOODY_SERIES = with_mood(
    SERIES, "observe", DRAWN.dirichlet(np.ones(3), (RULE.classes, 3)).tolist()
)
CATALOGUE = {"song": SONG, "series": MOODY_SERIES, "plain": SIMPLE}
WORTH = {"skip": 0.0, "like": 1.0, "partial": 0.4, "complete": 1.0}


class Moody:
    """What is to be believed of one user, by an independent filter."""

    def __init__(self, catalogue: Mapping[str, Mapping[str, Any]]) -> None:
        self.catalogue = catalogue
        self.filter = Filter([{"id": name, **catalogue[name]} for name in catalogue])
        self.told: tuple[int, ...] = ()

    def feeling(self, *, paused: bool = False) -> Feeling:
        return Feeling(self.told, paused)

    def like(self, name: str, *, paused: bool = False) -> float:
        self.settle(paused=paused)
        return self.filter.like(name)

    def take(self, signals: Mapping[str, str], *, paused: bool = False) -> None:
        """One slot, whose answers are in the order of their places."""
        self.settle(paused=paused)
        self.filter.take_together(signals)
        told = [signal for signal in signals.values() if signal != "none"]
        self.told += tuple(int(WORTH[signal] >= LIKED) for signal in told)

    def settle(self, *, paused: bool) -> None:
        number = self.feeling(paused=paused).of(RULE)
        for name, model in self.catalogue.items():
            mood = model.get("mood", {})
            given = {
                part: mood[part][number] for part in ("like", "observe") & mood.keys()
            }
            self.filter.items[name] = {**model, **given}


@pytest.fixture
def moody(service: Service) -> Service:
    """A service with an item of each model."""
    for name, model in CATALOGUE.items():
        service.put_model(name, model)
        service.put_item(name, name)
    service.set_policy("random")
    return service


def report(service: Service, item: str, signal: str) -> dict[str, Any]:
    form = {"item": item, "signal": signal}
    answer = service.client.post("/v1/users/ann/plays", json=form)
    assert answer.is_success, answer.text
    told: dict[str, Any] = answer.json()
    return told


def check(service: Service, oracle: Moody, *, paused: bool = False) -> None:
    """What is believed is what the oracle says, and what the log says."""
    held = service.beliefs("ann", item=list(oracle.catalogue))
    for each in held["beliefs"]:
        name = each["item"]
        expected = oracle.filter.beliefs[name]
        assert each["belief"] == pytest.approx(expected, abs=1e-9)
        like = oracle.like(name, paused=paused)
        assert each["like"] == pytest.approx(like, abs=1e-9)
    feeling = oracle.feeling(paused=paused)
    assert held["mood"]["number"] == feeling.of(RULE)
    assert held["mood"]["tendency"] == pytest.approx(feeling.tendency(RULE))
    assert held["mood"]["paused"] == paused
    last = [("skip", "like")[told] for told in oracle.told[-1:]]
    assert held["mood"]["last"] == last
    [audited] = audit(service)
    assert (audited.stale, audited.findings) == (False, [])
    before = service.beliefs("ann")
    rebuild(service)
    assert service.beliefs("ann") == before


def test_answers_to_any_item_change_what_is_expected_of_all(moody: Service) -> None:
    oracle, chance = Moody(CATALOGUE), random.Random(3)  # noqa: S311 - a listener

    play = moody.next("ann")
    for _ in range(40):
        item = play["item"]
        assert play["like"] == pytest.approx(oracle.like(item), abs=1e-9)
        believed = oracle.filter.beliefs[item]
        told = chances(oracle.filter.items[item]) | {"none": [0.1] * len(believed)}
        weights = [float(np.dot(believed, told[name])) for name in told]
        [signal] = chance.choices(list(told), weights)
        play = moody.answer(play["play"], signal, next=True)["next"]
        oracle.take({item: signal})

    check(moody, oracle)


def test_plays_of_a_slot_are_in_one_mood_however_they_are_answered(
    moody: Service,
) -> None:
    oracle = Moody(CATALOGUE)
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        plays = moody.next("ann", count=3)["plays"]
        signals = {}
        for play in plays:
            assert play["like"] == pytest.approx(oracle.like(play["item"]), abs=1e-9)
            best = "complete" if play["item"] == "series" else "like"
            signals[play["item"]] = best if play["place"] == order[0] else "skip"

        for place in order:
            moody.answer(plays[place]["play"], signals[plays[place]["item"]])
        oracle.take(signals)

        check(moody, oracle)


def test_a_late_answer_changes_the_mood_of_what_was_played_since(
    moody: Service,
) -> None:
    oracle = Moody(CATALOGUE)
    first, second = moody.next("ann", count=2, candidate=["song", "series"])["plays"]
    answers = {"song": "like", "series": "complete"}
    moody.answer(first["play"], answers[first["item"]])
    report(moody, "plain", "skip")
    report(moody, first["item"], "skip")

    moody.answer(second["play"], answers[second["item"]])

    oracle.take({each["item"]: answers[each["item"]] for each in (first, second)})
    oracle.take({"plain": "skip"})
    oracle.take({first["item"]: "skip"})
    check(moody, oracle)


def test_after_a_pause_a_play_is_in_another_mood(
    moody: Service, encore: Encore, tmp_path: Path
) -> None:
    oracle = Moody(CATALOGUE)
    at = datetime(2026, 3, 1, tzinfo=UTC)
    lines = []
    for item, signal, seconds, together in (
        ("song", "like", 0, False),
        ("plain", "skip", 60, False),
        ("song", "skip", 61, False),
        ("series", "complete", 3600, True),
        ("series", "partial", 60.000001, False),
        ("song", "like", -7200, False),
        ("plain", "like", 59, False),
    ):
        at += timedelta(seconds=seconds)
        play = {"user": "ann", "item": item, "signal": signal, "at": at.isoformat()}
        lines.append(json.dumps(play | ({"together": True} if together else {})))
    file = tmp_path / "history.ndjson"
    file.write_text("\n".join(lines))
    database = ("--database-url", moody.settings.database_url)

    entered = encore("import", "history", file, *database)

    assert entered.status == 0, entered.err
    oracle.take({"song": "like"})
    oracle.take({"plain": "skip"})
    oracle.take({"song": "skip", "series": "complete"}, paused=True)
    oracle.take({"series": "partial"}, paused=True)
    oracle.take({"song": "like"})
    oracle.take({"plain": "like"})
    check(moody, oracle, paused=True)
    play = moody.next("ann")
    like = oracle.like(play["item"], paused=True)
    assert play["like"] == pytest.approx(like, abs=1e-9)
    moody.answer(play["play"], "skip")
    oracle.take({play["item"]: "skip"}, paused=True)
    check(moody, oracle)


@pytest.mark.parametrize("count", [1, 2])
def test_decisions_in_a_mood_can_be_taken_again(moody: Service, count: int) -> None:
    moody.put_item("other", "song")
    moody.set_policy("exact_rollout", base="myopic", leaf="none")
    chosen: dict[str, tuple[str, float, float]] = {}
    for slot in range(8):
        told = moody.next("ann", count=count)
        for play in told.get("plays", [told]):
            chosen[play["play"]] = (play["item"], play["like"], play["propensity"])
            moody.answer(play["play"], "skip" if slot % 3 else "none")
        report(moody, "song", "like")

    assert dict(taken_again(moody, list(chosen))) == chosen
    last, (_, like, _) = [*chosen.items()][-1]
    record = moody.client.get(f"/v1/plays/{last}", params={"explain": True}).json()
    assert record["explanation"]["candidates"][0]["like"] == like


def test_plans_tell_the_mood_that_they_are_made_in(moody: Service) -> None:
    oracle = Moody(CATALOGUE)
    for item, signal in (("song", "like"), ("plain", "like")):
        report(moody, item, signal)
        oracle.take({item: signal})
    number = oracle.feeling().of(RULE)

    plan = moody.client.get("/v1/users/ann/playlist", params={"length": 3}).json()
    path = "/v1/users/ann/items/song/forecast"
    forecast = moody.client.get(path, params={"slots": 2}).json()

    assert plan["mood"]["number"] == forecast["mood"]["number"] == number
    assert forecast["like"] == pytest.approx(oracle.like("song"), abs=1e-9)
    for play in plan["plays"]:
        assert play["like"] == pytest.approx(oracle.like(play["item"]), abs=1e-9)
        oracle.take({play["item"]: "none"})


def test_a_timeline_is_in_the_moods_of_its_slots(moody: Service) -> None:
    oracle = Moody(CATALOGUE)
    likes = []
    for item, signal in (("song", "like"), ("plain", "like"), ("song", "skip")) * 3:
        likes.append(oracle.like("song"))
        report(moody, item, signal)
        oracle.take({item: signal})
    likes.append(oracle.like("song"))

    told = moody.client.get("/v1/users/ann/items/song/timeline").json()["timeline"]

    assert [point["like"] for point in told] == pytest.approx(likes, abs=1e-9)


def test_without_moods_none_is_told(example: Service) -> None:
    report(example, "item-1", "like")

    assert example.beliefs("ann")["mood"] is None
    assert example.client.get("/v1/users/ann/playlist").json()["mood"] is None


def test_moods_arise_and_change_for_users_who_have_played(
    service: Service, encore: Encore, tmp_path: Path
) -> None:
    for name in ("song", "plain"):
        service.put_model(name, SIMPLE)
        service.put_item(name, name)
    for signal in ("like", "skip", "skip"):
        report(service, "plain", signal)

    service.put_model("unused", SONG)

    held = service.beliefs("ann")["mood"]
    assert held["number"] == Feeling((1, 0, 0)).of(RULE)
    service.put_model("song", SONG)
    other = SONG["mood"] | {"memory": None}
    refused = service.client.put("/v1/models/song", json=SONG | {"mood": other})
    assert (refused.status_code, refused.json()["code"]) == (409, "moods_differ")
    [fault] = refused.json()["errors"]
    assert (fault["field"], fault["value"]) == ("mood", "unused")
    assert "'song'" in fault["message"]
    file = tmp_path / "models.ndjson"
    both = [{"id": name, **SONG, "mood": other} for name in ("song", "unused")]
    file.write_text("\n".join(map(json.dumps, both)))
    at = ("--database-url", service.settings.database_url)
    dry = encore("import", "models", file, "--dry-run", *at)
    assert dry.status == 0, dry.err
    imported = encore("import", "models", file, *at)
    assert imported.status == 0, imported.err
    changed = service.beliefs("ann")["mood"]
    rule = Mood(answers=1, memory=None, levels=(0.5,), pause_s=60.0)
    assert changed["tendency"] == pytest.approx(Feeling((1, 0, 0)).tendency(rule))
    assert changed["tendency"] != pytest.approx(held["tendency"])
    report(service, "plain", "like")
    [audited] = audit(service)
    assert (audited.stale, audited.findings) == (False, [])


@pytest.mark.parametrize("model", [SONG, MOODY_SERIES], ids=["like", "signals"])
def test_what_is_told_of_a_mood_is_complete(
    service: Service, model: dict[str, Any], encore: Encore, tmp_path: Path
) -> None:
    shares = DRAWN.dirichlet(np.ones(RULE.classes)).tolist()
    given = model | {"mood": model["mood"] | {"shares": shares}}
    service.put_model("song", given)

    view = service.client.get("/v1/models/song").json()
    again = service.client.put("/v1/models/song", json=given)

    assert again.json()["version"] == view["version"] == 1
    told = view["mood"]
    assert told.pop("classes") == RULE.classes
    assert {name: told[name] for name in given["mood"]} == given["mood"]
    part = "like" if "like" in given["mood"] else "observe"
    mean = np.tensordot(shares, given["mood"][part], 1)
    np.testing.assert_allclose(view[part], mean, atol=1e-12)
    at = ("--database-url", service.settings.database_url)
    assert encore("export", "models", tmp_path / "models.ndjson", *at).status == 0
    line = json.loads((tmp_path / "models.ndjson").read_text())
    assert line.pop("source") == ""
    assert line == {"id": "song", **given}


def changed(**fields: object) -> dict[str, Any]:
    mood = {**SONG["mood"], **fields}
    return SONG | {"mood": {name: v for name, v in mood.items() if v != "left out"}}


@pytest.mark.parametrize(
    ("model", "field", "code"),
    [
        (SONG | {"like": [0.1, 0.2]}, "like", "invalid_model"),
        (changed(like="left out"), "mood.like", "invalid_model"),
        (changed(observe=[[[0.5, 0.5]] * 2] * 12), "mood.observe", "invalid_model"),
        (changed(like=SONG["mood"]["like"][:-1]), "mood.like", "invalid_model"),
        (changed(like=[[0.1, 0.2], *[[0.1]] * 11]), "mood.like.1", "invalid_request"),
        (changed(shares=[1.0]), "mood.shares", "invalid_model"),
        (changed(levels=[0.5, 0.5]), "mood.levels", "invalid_model"),
        (changed(answers=5), "mood.answers", "invalid_request"),
        (changed(memory=0.5), "mood.memory", "invalid_request"),
        (changed(pause_s="left out"), "mood.pause_s", "invalid_request"),
        (MOODY_SERIES | {"observe": SERIES["observe"]}, "observe", "invalid_model"),
        (SERIES | {"mood": SONG["mood"]}, "observe", "invalid_model"),
        (
            {"states": [f"s{n}" for n in range(64)], "prior": [1, *[0] * 63]}
            | {name: np.eye(64).tolist() for name in ("play", "rest")}
            | {"mood": {**MANY, "like": [[0.5] * 64]}},
            "mood",
            "invalid_model",
        ),
    ],
)
def test_the_field_at_fault_is_named(
    service: Service, model: dict[str, Any], field: str, code: str
) -> None:
    refused = service.client.put("/v1/models/song", json=model)

    assert (refused.status_code, refused.json()["code"]) == (422, code)
    assert refused.json()["errors"][0]["field"] == field


def test_a_mood_has_no_bound(moody: Service, encore: Encore, tmp_path: Path) -> None:
    told = moody.client.get("/v1/admin/bound")
    file = tmp_path / "models.ndjson"
    lines = [{"id": name, **model} for name, model in CATALOGUE.items()]
    file.write_text("\n".join(map(json.dumps, lines)))
    tried = ("--policy", "myopic", "--runs", 20, "--slots", 20)

    simulated = encore("simulate", "--models", file, *tried)

    assert told.status_code == httpx.codes.OK
    for part in ("bound", "price", "best_fixed", "gap", "gap_percent"):
        assert told.json()[part] is None
    assert "mood" in told.json()["reason"]
    assert simulated.status == 0, simulated.err
    assert "no bound" in simulated.out
    lines[0]["mood"] = lines[0]["mood"] | {"memory": None}
    file.write_text("\n".join(map(json.dumps, lines)))
    refused = encore("simulate", "--models", file, *tried)
    assert refused.status == 1
    assert "different moods" in refused.err


def test_a_mood_that_matters_is_learned_and_published(
    service: Service, encore: Encore, tmp_path: Path
) -> None:
    for name in ("guess", "same"):
        service.put_model(name, SIMPLE)
        service.put_item(name, name)
    luck, at = np.random.default_rng(5), datetime.now(UTC) - timedelta(days=30)
    lines = []
    for user in range(30):
        liked = True
        for slot in range(90):
            liked ^= bool(luck.random() < 0.15)
            item = ("guess", "same")[int(luck.integers(2))]
            moment = (at + timedelta(minutes=5 * slot)).isoformat()
            signal = "like" if liked else "skip"
            play = {"user": f"user-{user}", "item": item, "signal": signal}
            lines.append(json.dumps(play | {"at": moment}))
    (tmp_path / "history.ndjson").write_text("\n".join(lines))
    database = ("--database-url", service.settings.database_url)
    entered = encore("import", "history", tmp_path / "history.ndjson", *database)
    assert entered.status == 0, entered.err
    out, quick = tmp_path / "out", ("--states", 2, "--starts", 1, "--steps", 40)

    learned = encore("fit", "--mood", "--out", out, *quick, "--json", *database)
    published = encore("publish", out, "--json", "--margin", 0.02, *database)

    assert learned.status == 0, learned.err
    losses = {name: told["log_loss"] for name, told in learned.json["held_out"].items()}
    assert losses["learned"] < losses["without mood"] - 0.04
    assert learned.json["mood"]["pause_s"] == Mood().pause_s
    assert published.status == 0, published.err
    assert "mood" in [check["name"] for check in published.json["checks"]]
    assert all(not each.stale and not each.findings for each in audit(service))
    view = service.client.get("/v1/models/learned").json()
    assert view["mood"]["classes"] == Mood().classes
    assert service.beliefs("user-3")["mood"]["paused"]
    assert service.next("user-3")["like"] > 0
