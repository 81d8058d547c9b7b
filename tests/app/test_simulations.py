"""Simulations over HTTP: the same numbers as the command's, told as they come."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from app.settings import Settings
from tests.app.commands import Encore
from tests.app.service import Service

PATH = "/v1/admin/simulations"
LONG = {"policies": [{"name": "exact_rollout"}], "runs": 100_000}


def told(service: Service, **form: object) -> list[dict[str, Any]]:
    answer = service.client.post(PATH, json=form)
    assert answer.is_success, answer.text
    assert answer.headers["content-type"].startswith("application/x-ndjson")
    return [json.loads(line) for line in answer.text.splitlines()]


@contextmanager
def begun(service: Service, **form: object) -> Iterator[Iterator[str]]:
    """A simulation of which one line has come; the others."""
    with service.client.stream("POST", PATH, json=form) as answer:
        assert answer.status_code == 200
        lines = answer.iter_lines()
        assert json.loads(next(lines))["stage"] == "bound"
        yield lines


def named(*names: str) -> list[dict[str, str]]:
    return [{"name": name} for name in names]


def test_an_example_gives_what_the_command_gives(
    service: Service, encore: Encore
) -> None:
    names = ("random", "myopic", "whittle")
    course = {"runs": 60, "slots": 40, "discount": 0.9, "seed": 7}

    result = told(service, example=2, policies=named(*names), **course)[-1]["result"]

    options = [f"--{name}={value}" for name, value in course.items()]
    options += [f"--policy={name}" for name in names]
    expected = encore("simulate", "--example", 2, *options, "--json").json
    for mine, other in zip(result["policies"], expected["policies"], strict=True):
        for name in ("label", "params", "mean", "ci95", "difference", "gap_percent"):
            assert mine[name] == other[name]
        assert mine["play_shares"] == other["play_shares"]
        assert mine["curve"][-1] == pytest.approx(mine["mean"])
        assert mine["curve"] == sorted(mine["curve"])
        assert len(mine["curve"]) == len(mine["curve_error"]) == 40
    assert result["slots_shown"] == list(range(1, 41))
    for name in ("bound", "remainder", "models", "items"):
        assert result[name] == expected[name]


def test_the_paper_s_states_have_no_bound(service: Service) -> None:
    form = {"policies": named("myopic"), "runs": 20, "slots": 10, "start": "state"}

    result = told(service, example=1, **form)[-1]["result"]

    assert result["bound"] is None
    assert "states" in result["reason"]
    assert result["policies"][0]["gap"] is None


def test_the_policy_in_force_is_tried_first(example: Service) -> None:
    example.set_policy("round_robin")

    form = {"policies": named("myopic", "round_robin"), "runs": 50, "slots": 700}
    lines = told(example, **form)

    result = lines[-1]["result"]
    labels = [one["label"] for one in result["policies"]]
    assert labels == ["round_robin (in force)", "myopic"]
    assert result["policies"][0]["difference"] == 0
    for one in result["policies"]:
        assert sum(one["play_shares"]) == pytest.approx(1)
        assert one["mean"] - one["ci95"] <= result["bound"]
    assert len(result["slots_shown"]) <= 300
    assert result["slots_shown"][-1] == 700
    assert lines[0] == {"stage": "bound", "share": 0.0}
    assert all(0 <= line["share"] <= 1 for line in lines[:-1])


@pytest.mark.parametrize(
    ("form", "code", "field"),
    [
        ({"policies": []}, "invalid_request", "policies"),
        ({"policies": named("best")}, "invalid_request", "policies.0.name"),
        (
            {"policies": [{"name": "rollout", "params": {"trajectories": 0}}]},
            "invalid_request",
            "policies.0.params.trajectories",
        ),
        (
            {"policies": named("myopic"), "example": 5},
            "invalid_request",
            "example",
        ),
        (
            {"policies": named("myopic"), "start": "state"},
            "invalid_request",
            "start",
        ),
        (
            {"policies": named("myopic"), "example": 4, "start": "state"},
            "invalid_request",
            "start",
        ),
        (
            {
                "policies": [
                    {"name": "whittle_mc", "params": {"iterations": 10_000}},
                ]
            },
            "invalid_request",
            "policies.0.params.iterations",
        ),
        ({"policies": named("myopic"), "runs": 1}, "invalid_request", "runs"),
        ({"policies": named("myopic"), "discount": 1}, "invalid_request", "discount"),
        (LONG | {"runs": 10_000_000}, "too_long_to_simulate", "runs"),
        (
            LONG | {"runs": 2, "slots": 1_000_000, "discount": 0.999},
            "too_long_to_simulate",
            "slots",
        ),
    ],
)
def test_what_cannot_be_tried_is_refused(
    example: Service, form: dict[str, object], code: str, field: str
) -> None:
    answer = example.client.post(PATH, json=form)

    assert answer.status_code == 422
    assert answer.json()["code"] == code
    assert [fault["field"] for fault in answer.json()["errors"]] == [field]


def test_an_empty_catalogue_has_nothing_to_try(service: Service) -> None:
    answer = service.client.post(PATH, json={"policies": named("myopic")})

    assert (answer.status_code, answer.json()["code"]) == (409, "nothing_to_play")


def test_only_admins_may(example: Service) -> None:
    key = example.client.post("/v1/admin/keys", json={"scope": "serve", "name": "app"})
    with example.with_key(key.json()["key"]) as client:
        answer = client.post(PATH, json={"policies": named("myopic")})
    assert answer.status_code == 403


class TestAtATime:
    """One goes on in a process, as long as somebody listens."""

    @pytest.fixture
    def settings(self, settings: Settings) -> Settings:
        return settings.with_changes(simulation_budget="1000000")

    def test_another_one_is_asked_to_wait(self, example: Service) -> None:
        with begun(example, **LONG):
            answer = example.client.post(PATH, json={"policies": named("myopic")})
            play = example.next("ann")

        assert (answer.status_code, answer.json()["code"]) == (503, "simulator_busy")
        assert int(answer.headers["Retry-After"]) > 0
        assert play["user"] == "ann"

    def test_when_nobody_listens_it_ends(self, example: Service) -> None:
        with begun(example, **LONG):
            pass

        form = {"policies": named("myopic"), "runs": 2, "slots": 1}
        while (answer := example.client.post(PATH, json=form)).status_code == 503:
            pass
        assert answer.is_success
