"""Models that name their signals, over HTTP: from what is told to what is believed."""

import json
import random
from typing import Any

import httpx
import numpy as np
import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.app.service import Service
from tests.catalogues import SERIES, SIMPLE
from tests.filter import Filter, chances

SIGNALS = SERIES["signals"]
EACH_STATE: dict[str, Any] = {
    name: SIMPLE[name] for name in ("states", "play", "rest", "prior")
} | {"signals": ["no", "yes"], "observe": [[1, 0], [0, 1]], "reward": [0.1, 0.7]}
NOTHING: dict[str, Any] = EACH_STATE | {
    "signals": ["heard"],
    "observe": [[1], [1]],
    "reward": [0.5],
}
CATALOGUE = {"series": SERIES, "song": SIMPLE, "clear": EACH_STATE, "mute": NOTHING}
SHARES = {"skip": 0, "complete": 0.9, "partial": 0.25}


@pytest.fixture
def series(service: Service) -> Service:
    """A service with one item, that may be skipped, played in part, or completed."""
    service.put_model("series", SERIES)
    service.put_item("pilot", "series")
    service.set_policy("myopic")
    return service


def feedback(service: Service, play: str, **told: object) -> httpx.Response:
    return service.client.post(f"/v1/plays/{play}/feedback", json=told)


def report(service: Service, key: str | None = None, **told: object) -> httpx.Response:
    headers = {} if key is None else {"Idempotency-Key": key}
    form = {"item": "pilot", **told}
    return service.client.post("/v1/users/ann/plays", json=form, headers=headers)


def belief(service: Service) -> list[float]:
    [held] = service.beliefs("ann", item="pilot")["beliefs"]
    found: list[float] = held["belief"]
    return found


def believed(*signals: str) -> list[float]:
    """The belief after these answers, by the independent filter."""
    oracle = Filter([{"id": "pilot", **SERIES}])
    for signal in signals:
        oracle.take("pilot", signal)
    return oracle.beliefs["pilot"]


def test_beliefs_are_those_of_an_independent_filter(service: Service) -> None:
    for name, model in CATALOGUE.items():
        service.put_model(name, model)
        service.put_item(name, name)
    service.set_policy("random")
    paper = [{"id": name, **model} for name, model in CATALOGUE.items()]
    oracle = Filter(paper)
    chance = random.Random(7)  # noqa: S311 - a seeded listener
    play = service.next("ann")

    for _ in range(60):
        item = play["item"]
        assert play["signals"] == CATALOGUE[item].get("signals", ["skip", "like"])
        assert play["like"] == pytest.approx(oracle.like(item), abs=1e-9)
        told = chances(CATALOGUE[item]) | {"none": [0.1] * len(oracle.beliefs[item])}
        weights = [np.dot(oracle.beliefs[item], told[name]) for name in told]
        [signal] = chance.choices(list(told), weights)
        taken = service.answer(play["play"], signal, next=True)
        assert taken["signal"] == signal
        oracle.take(item, signal)
        play = taken["next"]

    held = service.beliefs("ann", item=list(CATALOGUE))["beliefs"]
    for each in held:
        assert each["belief"] == pytest.approx(oracle.beliefs[each["item"]], abs=1e-9)
        assert each["like"] == pytest.approx(oracle.like(each["item"]), abs=1e-9)


def test_only_signals_of_the_items_model_are_taken(series: Service) -> None:
    play = series.next("ann")["play"]

    for told in ({"signal": "like"}, {"signal": "Partial"}, {"fraction": 0.5}):
        refused = feedback(series, play, **told)
        reported = report(series, **told)

        [field] = told
        for answer in (refused, reported):
            assert (answer.status_code, answer.json()["code"]) == (
                422,
                "unknown_signal",
            )
            [fault] = answer.json()["errors"]
            assert (fault["field"], fault["value"]) == (field, told[field])
            assert "skip, partial, complete, none" in fault["message"]

    assert series.next("ann")["pending"]
    assert feedback(series, play, signal="partial").json()["slot"] == 1
    assert belief(series) == pytest.approx(believed("partial"), abs=1e-12)


@pytest.mark.parametrize(
    "signal", ["", "x" * 65, "a b", "a\u200bb", "\u0000", "\ud800", 1, True, ["skip"]]
)
def test_what_is_no_name_is_no_signal(series: Service, signal: object) -> None:
    play = series.next("ann")["play"]

    refused = series.client.post(
        f"/v1/plays/{play}/feedback",
        content=json.dumps({"signal": signal}),
        headers={"Content-Type": "application/json"},
    )

    assert (refused.status_code, refused.json()["code"]) == (422, "invalid_request")
    assert refused.json()["errors"][0]["field"] == "signal"


def test_answers_count_exactly_once(series: Service) -> None:
    play = series.next("ann")["play"]
    first = feedback(series, play, signal="complete").json()

    again = feedback(series, play, signal="complete")
    others = [
        feedback(series, play, **told)
        for told in ({"signal": "skip"}, {"signal": "love"}, {"fraction": 1})
    ]

    assert again.json() == first | {"repeated": True}
    assert [answer.status_code for answer in others] == [409, 409, 409]
    assert others[2].json()["errors"][0]["field"] == "fraction"
    assert belief(series) == pytest.approx(believed("complete"), abs=1e-12)


def test_a_share_is_the_signal_that_the_model_says(series: Service) -> None:
    series.put_model("series", SERIES | {"fractions": SHARES})
    expected = {
        0: "skip",
        0.249: "skip",
        0.25: "partial",
        0.9: "complete",
        1: "complete",
    }

    for fraction, signal in expected.items():
        play = series.next("ann")["play"]
        taken = feedback(series, play, fraction=fraction).json()
        assert (taken["signal"], taken["repeated"]) == (signal, False)
        assert feedback(series, play, signal=signal).json()["repeated"]

    told = report(series, fraction=0.5)
    assert told.json()["signal"] == "partial"


def test_a_model_of_skip_and_like_by_name_takes_shares(series: Service) -> None:
    names = {"signals": ["like", "skip"], "observe": [[0.1, 0.9]] * 3, "reward": [1, 0]}
    series.put_model("series", SERIES | names)

    assert report(series, fraction=0.79).json()["signal"] == "skip"
    assert report(series, fraction=0.8).json()["signal"] == "like"


def test_shares_may_change_without_a_new_meaning_for_beliefs(series: Service) -> None:
    report(series, signal="partial")
    play = series.next("ann")["play"]
    series.put_model("series", SERIES | {"fractions": SHARES})
    feedback(series, play, fraction=0.3)
    before = series.beliefs("ann")
    series.put_model("series", SERIES | {"fractions": {"complete": 0}})

    again = feedback(series, play, fraction=0.3).json()
    other = feedback(series, play, fraction=0.4)

    assert (again["signal"], again["repeated"]) == ("partial", True)
    assert other.status_code == 409
    assert series.beliefs("ann") == before


def test_a_signal_that_a_model_lost_counts_as_never_answered(series: Service) -> None:
    play = series.next("ann")["play"]
    feedback(series, play, signal="partial")
    first = report(series, "a", signal="partial").json()
    report(series, signal="complete")
    before = belief(series)
    two = {"signals": ["skip", "complete"], "reward": [0, 1]} | {
        "observe": [[0.8, 0.2], [0.5, 0.5], [0.2, 0.8]]
    }

    put = series.client.put("/v1/models/series", json=SERIES | two).json()

    [warning] = put["warnings"]
    assert "'partial'" in warning
    assert "never answered" in warning
    assert series.client.get("/v1/models/series").json()["warnings"] == []
    oracle = Filter([{"id": "pilot", **SERIES, **two}])
    for signal in ("none", "none", "complete"):
        oracle.take("pilot", signal)
    assert belief(series) == pytest.approx(oracle.beliefs["pilot"], abs=1e-12)
    assert feedback(series, play, signal="partial").json()["repeated"]
    assert report(series, "a", signal="partial").json() == first | {"repeated": True}
    assert report(series, "a", signal="complete").status_code == 409
    assert report(series, signal="partial").status_code == 422
    log = series.client.get("/v1/users/ann/plays").json()["plays"]
    assert [play["signal"] for play in log] == ["complete", "partial", "partial"]
    series.put_model("series", SERIES)
    assert belief(series) == before


def test_an_item_that_moves_to_likes_forgets_what_it_was_told(series: Service) -> None:
    report(series, signal="partial")
    report(series, signal="skip")
    series.put_model("song", SIMPLE)

    series.put_item("pilot", "song")

    oracle = Filter([{"id": "pilot", **SIMPLE}])
    for signal in ("none", "skip"):
        oracle.take("pilot", signal)
    assert belief(series) == pytest.approx(oracle.beliefs["pilot"], abs=1e-12)


def test_what_is_told_of_a_model_is_complete(series: Service) -> None:
    series.put_model("song", SIMPLE)
    series.put_model("clear", EACH_STATE | {"fractions": {"no": 0, "yes": 0.5}})

    views = {
        name: series.client.get(f"/v1/models/{name}").json()
        for name in ("series", "song", "clear")
    }

    assert {name: views["series"][name] for name in SERIES} == SERIES
    assert views["series"]["like"] == pytest.approx([0.18, 0.46, 0.84], abs=1e-12)
    assert views["series"]["fractions"] is None
    assert {name: views["song"][name] for name in SIMPLE} == SIMPLE
    assert views["song"]["signals"] == ["skip", "like"]
    assert views["song"]["reward"] == [0, 1]
    observed = zip(views["song"]["observe"], ([0.8, 0.2], [0.2, 0.8]), strict=True)
    assert all(row == pytest.approx(wanted) for row, wanted in observed)
    assert views["clear"]["like"] == [0.1, 0.7]
    assert views["clear"]["fractions"] == {"no": 0, "yes": 0.5}


def test_answers_are_counted_by_their_signal(series: Service) -> None:
    def partial() -> float:
        text = httpx.get(f"{series.url}/metrics").text
        return sum(
            sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
            if sample.name == "encore_feedback_total"
            and sample.labels == {"signal": "partial", "source": "reported"}
        )

    before = partial()

    report(series, signal="partial")

    assert partial() == before + 1
