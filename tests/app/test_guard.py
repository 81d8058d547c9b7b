"""The guard: a wrong model is noticed, and does not choose for long."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from functools import partial
from statistics import mean
from typing import Any

import pytest
import structlog

from app.services import guard, guard_watch
from app.services.guard_rules import TERMS
from app.settings import Settings
from app.storage.judgements import State
from tests.app.commands import Encore
from tests.app.guards import (
    QUICK,
    TIRING,
    WRONG,
    Listeners,
    checks,
    judged,
    report,
    until_fallen,
)
from tests.app.indexes import metric
from tests.app.service import Service
from tests.catalogues import SERIES

ONE = replace(QUICK, least=1, step=1)


def in_force(service: Service) -> dict[str, Any]:
    policy: dict[str, Any] = service.client.get("/v1/admin/policy").json()
    return policy


@pytest.fixture
def fallen(service: Service) -> Listeners:
    """Listeners of a wrong model, whom the guard has given round robin instead."""
    listeners = Listeners(service)
    listeners.open(WRONG)
    until_fallen(listeners)
    return listeners


def test_with_the_guard_a_wrong_model_costs_no_likes_in_the_end(
    service: Service,
) -> None:
    """The last 400 plays; 0.05 is less than two standard errors of the difference.

    Each time the same listeners with the same luck, and the terms that are in use.
    """
    safe = Listeners(service, users=20, name="safe")
    safe.open(WRONG)
    liked: list[bool] = []
    for _ in range(25):
        liked += safe.listen(3)
        checks(service, terms=TERMS)
    earned = {"safe": mean(liked[-400:])}
    for arm, policy, plays in (("even", "round_robin", 40), ("wrong", "myopic", 30)):
        listeners = Listeners(service, users=20, name=arm)
        listeners.open(WRONG, policy)
        earned[arm] = mean(listeners.listen(plays)[-400:])

    assert earned["safe"] >= earned["even"] - 0.05
    assert earned["wrong"] < earned["even"] - 0.3


def test_a_fall_is_a_swap_like_any_other(fallen: Listeners) -> None:
    service = fallen.service

    policy, told = in_force(service), report(service)

    assert (policy["name"], policy["by"]) == ("round_robin", "guard")
    assert policy["note"] == "Predicted worse than a simple rate: 'pop'."
    assert policy["version"] == 3
    assert (told["fallen"], told["instead_of"]) == (True, 2)
    [model] = told["models"]
    assert (model["state"], model["falls"]) == ("alarm", 1)
    scores = model["scores"]
    simple = min(scores["constant"], scores["rate"])
    assert scores["excess"] == pytest.approx(scores["model"] - simple)
    assert scores["interval"][0] > 0.01
    assert scores["predicted"] > scores["answered"] + scores["calibration_error"] / 2
    assert fallen.service.next("new")["policy"]["name"] == "round_robin"
    back = service.client.post("/v1/admin/policy/rollback").json()
    assert (back["name"], back["restores"]) == ("myopic", 2)


def test_a_restart_finds_the_alarm_and_raises_it_no_second_time(
    fallen: Listeners,
) -> None:
    before = judged(fallen.service)
    again = Service.start(fallen.service.settings)
    try:
        fallen.service = again
        fallen.listen(12)
        checks(again)
        after = judged(again)

        assert after["since"] == before["since"]
        assert (after["state"], after["falls"]) == ("alarm", 1)
        assert in_force(again)["version"] == 3
    finally:
        again.stop()


def test_of_several_processes_one_falls_back(service: Service) -> None:
    listeners = Listeners(service)
    listeners.open(WRONG)
    listeners.listen(6)
    checks(service)
    listeners.listen(6)

    checked = checks(service, times=4)

    assert sum(one.replaced is not None for one in checked) == 1
    assert (in_force(service)["name"], in_force(service)["version"]) == (
        "round_robin",
        3,
    )
    assert judged(service)["answers"] == 120


def test_a_better_version_brings_the_policy_back(fallen: Listeners) -> None:
    service = fallen.service
    service.put_model("pop", TIRING)
    checks(service)
    assert judged(service)["state"] == "trial"

    fallen.listen(7)
    checks(service)
    assert in_force(service)["name"] == "round_robin"
    fallen.listen(3)
    checks(service)

    policy = in_force(service)
    assert (policy["name"], policy["by"], policy["restores"]) == ("myopic", "guard", 2)
    assert judged(service)["state"] == "calm"
    assert not report(service)["fallen"]


def test_a_better_version_that_is_none_does_not(fallen: Listeners) -> None:
    fallen.service.put_model("pop", WRONG | {"like": [0.12, 0.83]})

    for _ in range(6):
        fallen.listen(3)
        checks(fallen.service)

    assert judged(fallen.service)["version"] == 2
    assert judged(fallen.service)["state"] == "alarm"
    assert in_force(fallen.service)["version"] == 3


def test_a_swap_is_respected_until_it_proves_wrong(fallen: Listeners) -> None:
    service = fallen.service
    fallen.listen(12)
    service.set_policy("myopic")

    checks(service)
    fallen.listen(7)  # the first of them still as round robin had it
    checks(service)
    after_one_look = in_force(service)
    fallen.listen(6)
    checks(service)

    assert (after_one_look["name"], after_one_look["version"]) == ("myopic", 4)
    assert (in_force(service)["name"], in_force(service)["version"]) == (
        "round_robin",
        5,
    )
    assert judged(service)["falls"] == 2
    assert judged(service)["needed"] == 4


def test_what_the_guard_did_last_stands_for_a_while(service: Service) -> None:
    listeners = Listeners(service)
    listeners.open(WRONG)
    until_fallen(listeners)
    service.put_model("pop", TIRING)
    terms = replace(QUICK, pause=timedelta(minutes=10))
    for _ in range(4):
        listeners.listen(4)
        checks(service, terms=terms)
    waiting = in_force(service)
    assert judged(service)["state"] == "calm"

    checks(service, terms=terms, later=timedelta(minutes=11))

    assert waiting["version"] == 3
    assert in_force(service)["version"] == 4


def test_where_it_only_watches_the_policy_stays(service: Service) -> None:
    listeners = Listeners(service)
    listeners.open(WRONG)
    for _ in range(6):
        listeners.listen(3)
        checks(service, None)

    assert judged(service)["state"] == "alarm"
    assert in_force(service)["name"] == "myopic"


def test_a_policy_that_asks_no_model_stays(service: Service) -> None:
    listeners = Listeners(service)
    listeners.open(WRONG, "random")
    for _ in range(6):
        listeners.listen(3)
        checks(service)

    assert judged(service)["state"] == "alarm"
    assert in_force(service)["name"] == "random"


def test_only_answers_to_what_was_recommended_count_each_once(
    service: Service,
) -> None:
    service.put_model("series", SERIES)
    service.put_item("pilot", "series")
    service.set_policy("myopic")
    for signal in ("partial", "none", "complete", "skip"):
        service.answer(service.next("ann")["play"], signal)
    service.client.post(
        "/v1/users/ann/plays", json={"item": "pilot", "signal": "skip"}
    ).raise_for_status()

    checks(service, terms=ONE)
    checks(service, terms=ONE)

    found = judged(service)
    assert found["answers"] == found["window"] == 3
    assert found["scores"]["answered"] == pytest.approx(1.4 / 3)


def test_skips_do_not_overtake_likes_that_take_their_time(service: Service) -> None:
    service.put_model("pop", TIRING)
    service.put_item("song", "pop")
    service.set_policy("myopic")
    slow = service.next("slow")["play"]
    service.answer(service.next("fast")["play"], "skip")

    checks(service, terms=ONE)
    waited = judged(service)["answers"]
    checks(service, terms=ONE, later=timedelta(minutes=31))
    given_up = judged(service)["answers"]
    service.answer(slow, "like")
    checks(service, terms=ONE)

    assert (waited, given_up) == (0, 1)
    assert judged(service)["answers"] == 1


def test_a_model_that_is_gone_is_forgotten(fallen: Listeners) -> None:
    service = fallen.service
    service.put_model("other", TIRING)
    for item in range(fallen.items):
        service.put_item(f"item-{item}", "other")
    service.client.delete("/v1/models/pop").raise_for_status()

    checks(service)

    assert [model["model"] for model in report(service)["models"]] == ["other"]
    assert in_force(service)["name"] == "myopic"


@contextmanager
def guarded(settings: Settings, **changes: object) -> Iterator[Service]:
    service = Service.start(settings.with_changes(**changes))
    try:
        yield service
    finally:
        service.stop()


def test_in_the_background_it_falls_back_counts_and_tells(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guard_watch, "EVERY", 0.05)
    monkeypatch.setattr(guard, "check", partial(guard.check, terms=QUICK))
    lines: list[dict[str, Any]] = []
    monkeypatch.setattr(
        guard_watch, "logger", structlog.wrap_logger(None, [partial(_noted, lines)])
    )
    policy = '{"name": "epsilon", "params": {"epsilon": 1}}'
    with guarded(
        settings, guard="fall_back", guard_policy=policy, log_level="warning"
    ) as service:
        falls = metric(service.client, "encore_guard_falls_total")
        listeners = Listeners(service)
        listeners.open(WRONG)
        end = time.monotonic() + 120
        while in_force(service)["by"] != "guard" and time.monotonic() < end:
            listeners.listen(1)
        present, told = in_force(service), report(service)
        while metric(service.client, "encore_guard_alarm") == 0:
            assert time.monotonic() < end
        grown = metric(service.client, "encore_guard_falls_total") - falls
        text = service.client.get("/metrics").text

    assert (present["name"], present["params"]["epsilon"]) == ("epsilon", 1)
    assert told["mode"] == "fall_back"
    assert told["outlook"] == "Version 2 is put back once every model is calm."
    assert grown == 1
    assert 'encore_guard_loss_nats{model="pop",predictor="constant"}' in text
    assert 'encore_guard_calibration_error{model="pop"}' in text
    changes = [line for line in lines if line.get("state") == State.ALARM.value]
    assert len(changes) == 1
    assert changes[0]["model"] == "pop"


def _noted(
    lines: list[dict[str, Any]],
    _logger: object,
    _method: str,
    line: Any,  # noqa: ANN401
) -> Any:  # noqa: ANN401
    lines.append(dict(line))
    raise structlog.DropEvent


@pytest.mark.parametrize(
    "policy", ["best", '{"name": "myopic", "params": {"x": 1}}', "{", '{"name": 1}']
)
def test_a_fallback_that_is_no_policy_is_refused_at_the_start(
    encore: Encore, monkeypatch: pytest.MonkeyPatch, policy: str
) -> None:
    monkeypatch.setenv("ENCORE_GUARD_POLICY", policy)

    said = encore("serve")

    assert said.status == 2
    assert "ENCORE_GUARD_POLICY" in said.err
