"""Item models over HTTP, and what a change of one means for beliefs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from policies import LIKE, SKIP, Model, ModelSet, replayed, rested
from tests.app.service import Service
from tests.catalogues import SERIES

POP: dict[str, Any] = {
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.4, 0.6]],
    "rest": [[0.7, 0.3], [0.1, 0.9]],
    "like": [0.2, 0.9],
    "prior": [0.5, 0.5],
}
THREE: dict[str, Any] = {
    "states": ["low", "mid", "high"],
    "play": [[0.8, 0.1, 0.1], [0.3, 0.4, 0.3], [0.2, 0.2, 0.6]],
    "rest": [[0.6, 0.3, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]],
    "like": [0.1, 0.5, 0.8],
    "prior": [0.2, 0.3, 0.5],
}
PLAYS = [("a", "like"), ("b", "skip"), ("a", "skip"), ("a", "like"), ("b", "like")]
WRONG: list[tuple[dict[str, Any], str, str]] = [
    ({"play": [[0.9, 0.1], [0.4, 0.7]]}, "invalid_model", "play.1"),
    ({"play": [[0.9, 0.1]]}, "invalid_request", "play"),
    ({"rest": THREE["rest"]}, "invalid_model", "rest"),
    ({"rest": [[1, 0], [1]]}, "invalid_request", "rest.1"),
    ({"like": [0.1, 0.5, 0.8]}, "invalid_model", "like"),
    ({"like": [0.1, 1.0000005]}, "invalid_model", "like.1"),
    ({"like": [0.1, 1.5]}, "invalid_request", "like.1"),
    ({"like": [0.1, "0.5"]}, "invalid_request", "like.1"),
    ({"like": [True, 0.5]}, "invalid_request", "like.0"),
    ({"like": [0.1, 10**400]}, "invalid_request", "like.1"),
    ({"prior": [-0.1, 1.1]}, "invalid_request", "prior.0"),
    ({"prior": [0.5, 0.4]}, "invalid_model", "prior"),
    ({"states": ["low", "low"]}, "invalid_model", "states.1"),
    ({"states": ["low", " "]}, "invalid_request", "states.1"),
    ({"states": ["low"]}, "invalid_request", "states"),
    ({"states": [f"s{n}" for n in range(65)]}, "invalid_request", "states"),
    ({"source": "\x00"}, "invalid_request", "source"),
    ({"colour": "red"}, "invalid_request", "colour"),
    ({"like": None}, "invalid_model", "like"),
    ({"observe": [[1], [1]]}, "invalid_model", "observe"),
    ({"reward": [1]}, "invalid_model", "reward"),
    ({"fractions": {"skip": 0}}, "invalid_model", "fractions"),
]
WRONG_SIGNALS: list[tuple[dict[str, Any], str, str]] = [
    ({"like": [0.1, 0.2, 0.3]}, "invalid_model", "like"),
    ({"observe": None}, "invalid_model", "observe"),
    ({"reward": None}, "invalid_model", "reward"),
    ({"signals": ["a", "b", "none"]}, "invalid_model", "signals.2"),
    ({"signals": ["a", "b", "a"]}, "invalid_model", "signals.2"),
    ({"signals": ["a", "b"]}, "invalid_model", "observe"),
    ({"signals": []}, "invalid_request", "signals"),
    ({"signals": ["a", "b", "c d"]}, "invalid_request", "signals.2"),
    ({"signals": ["a", "x" * 65, "c"]}, "invalid_request", "signals.1"),
    ({"signals": [f"y{n}" for n in range(33)]}, "invalid_request", "signals"),
    (
        {"observe": [*SERIES["observe"][:2], [0.5, 0.4, 0.2]]},
        "invalid_model",
        "observe.2",
    ),
    ({"observe": [*SERIES["observe"][:2], [0.5, 0.5]]}, "invalid_model", "observe"),
    ({"observe": SERIES["observe"][:2]}, "invalid_model", "observe"),
    ({"observe": [[1, 0, -0.1]] * 3}, "invalid_request", "observe.0.2"),
    ({"reward": [0, 1]}, "invalid_model", "reward"),
    ({"reward": [0, 1, 1.0000005]}, "invalid_model", "reward.2"),
    ({"reward": [0, 1, 1.5]}, "invalid_request", "reward.2"),
    ({"fractions": {"skip": 0, "love": 0.5}}, "invalid_model", "fractions.love"),
    ({"fractions": {"skip": 0.1}}, "invalid_model", "fractions"),
    ({"fractions": {"skip": 0, "partial": 0}}, "invalid_model", "fractions"),
    (
        {"fractions": {"skip": 0, "partial": 1.1}},
        "invalid_request",
        "fractions.partial",
    ),
    ({"fractions": {"skip": "0"}}, "invalid_request", "fractions.skip"),
    ({"fractions": {}}, "invalid_request", "fractions"),
]


def put(service: Service, model: str, form: object) -> tuple[int, dict[str, Any]]:
    answer = service.client.put(f"/v1/models/{model}", json=form)
    told: dict[str, Any] = answer.json()
    return answer.status_code, told


def report(service: Service, user: str, plays: Sequence[tuple[str, str]]) -> None:
    for item, signal in plays:
        answer = service.client.post(
            f"/v1/users/{user}/plays", json={"item": item, "signal": signal}
        )
        assert answer.is_success, answer.text


def beliefs(service: Service, user: str) -> dict[str, list[float]]:
    held = service.beliefs(user)["beliefs"]
    return {belief["item"]: belief["belief"] for belief in held}


def rebuilt(form: Mapping[str, Any], item: str) -> list[float]:
    """The belief that the plays give under a model, by the decision core alone."""
    models = ModelSet.of(
        [Model(*(form[name] for name in ("states", "play", "rest", "like", "prior")))]
    )
    signals = {"like": LIKE, "skip": SKIP}
    log = [(slot, signals[s]) for slot, (i, s) in enumerate(PLAYS) if i == item]
    slots, answers = (np.array(column, np.int64) for column in zip(*log, strict=True))
    slot, belief = replayed(models, 0, slots, answers)
    now = rested(models, np.array([0]), belief[None], np.array([len(PLAYS) - slot]))
    return [float(chance) for chance in now[0]]


@pytest.fixture
def played(service: Service) -> Service:
    """A service with two items of one model, of which a user has played both."""
    put(service, "pop", POP)
    for item in ("a", "b"):
        service.put_item(item, "pop")
    report(service, "ann", PLAYS)
    return service


def test_each_change_of_a_model_is_a_version(service: Service) -> None:
    first = put(service, "pop", POP)
    same = put(service, "pop", POP)
    second = put(service, "pop", THREE | {"source": "fitted"})
    old = service.client.get("/v1/models/pop", params={"version": 1}).json()
    unknown = service.client.get("/v1/models/pop", params={"version": 3})

    assert [status for status, _ in (first, same, second)] == [201, 200, 200]
    assert [told["version"] for _, told in (first, same, second)] == [1, 1, 2]
    assert service.client.get("/v1/models/pop").json() == second[1]
    assert old == first[1] == same[1]
    assert {name: old[name] for name in POP} == POP
    assert (unknown.status_code, unknown.json()["errors"][0]["field"]) == (
        404,
        "version",
    )


def test_signals_are_part_of_a_version(service: Service) -> None:
    changes: list[dict[str, Any]] = [
        {},
        {},
        {"reward": [0, 0.5, 1]},
        {"reward": [0, 0.5, 1], "signals": ["skip", "half", "complete"]},
        {"fractions": {"skip": 0, "partial": 0.2}},
        {"fractions": {"partial": 0.2, "skip": 0}},
    ]

    told = [put(service, "series", SERIES | change)[1] for change in changes]

    assert [each["version"] for each in told] == [1, 1, 2, 3, 4, 4]
    assert [each["warnings"] for each in told] == [[]] * 6
    second = service.client.get("/v1/models/series", params={"version": 2}).json()
    assert second == told[2]


def test_what_looks_like_a_mistake_is_told(service: Service) -> None:
    _, told = put(service, "pop", POP | {"like": [0.9, 0.2]})

    assert len(told["warnings"]) == 1
    assert service.client.get("/v1/models/pop").json()["warnings"] == told["warnings"]


def test_a_wrong_model_is_refused_with_the_field_named(
    service: Service,
) -> None:
    for change, code, field in WRONG:
        status, told = put(service, "pop", POP | change)

        assert (status, told["code"]) == (422, code), change
        assert told["errors"][0]["field"] == field
    for change, code, field in WRONG_SIGNALS:
        status, told = put(service, "pop", SERIES | change)

        assert (status, told["code"]) == (422, code), change
        assert told["errors"][0]["field"] == field
    assert service.client.get("/v1/models/pop").status_code == 404


def test_a_model_in_use_cannot_be_deleted(service: Service) -> None:
    put(service, "pop", POP)
    put(service, "jazz", THREE)
    service.put_item("a", "pop")
    service.client.delete("/v1/items/a")

    refused = service.client.delete("/v1/models/pop")
    service.put_item("a", "jazz")

    assert (refused.status_code, refused.json()["code"]) == (409, "model_in_use")
    assert "1 items" in refused.json()["errors"][0]["message"]
    assert service.client.delete("/v1/models/pop").status_code == 204
    assert service.client.delete("/v1/models/pop").status_code == 404
    assert service.client.get("/v1/models/pop").status_code == 404
    assert service.client.put("/v1/items/b", json={"model": "pop"}).status_code == 422
    status, again = put(service, "pop", POP)
    assert (status, again["version"]) == (201, 3)


def test_models_are_listed_page_by_page_in_their_latest_version(
    service: Service,
) -> None:
    for name in ("b", "a", "c", "gone"):
        put(service, name, POP)
    put(service, "b", THREE)
    service.client.delete("/v1/models/gone")

    first = service.client.get("/v1/models", params={"limit": 2}).json()
    query = {"limit": 2, "cursor": first["next"]}
    rest = service.client.get("/v1/models", params=query).json()

    listed = [*first["models"], *rest["models"]]
    versions = [(model["id"], model["version"]) for model in listed]
    assert versions == [("a", 1), ("b", 2), ("c", 1)]
    assert rest["next"] is None


def test_beliefs_follow_a_new_model_as_if_it_had_always_been_there(
    played: Service,
) -> None:
    before = beliefs(played, "ann")
    put(played, "pop", THREE)
    after = beliefs(played, "ann")
    put(played, "pop", POP)

    for item in ("a", "b"):
        assert_allclose(before[item], rebuilt(POP, item), atol=1e-12)
        assert_allclose(after[item], rebuilt(THREE, item), atol=1e-12)
    assert beliefs(played, "ann") == before


def test_an_answer_after_a_new_model_is_learned_under_it(played: Service) -> None:
    put(played, "pop", THREE)

    report(played, "ann", [("b", "skip")])

    first = beliefs(played, "ann")
    put(played, "pop", POP)
    put(played, "pop", THREE)
    assert_allclose(beliefs(played, "ann")["b"], first["b"], atol=1e-12)


def test_an_item_that_moves_to_another_model_is_believed_anew(played: Service) -> None:
    put(played, "three", THREE)

    played.put_item("b", "three")

    after = beliefs(played, "ann")
    assert_allclose(after["a"], rebuilt(POP, "a"), atol=1e-12)
    assert_allclose(after["b"], rebuilt(THREE, "b"), atol=1e-12)


def test_more_items_and_models_leave_beliefs_as_they_were(played: Service) -> None:
    before = beliefs(played, "ann")

    put(played, "three", THREE)
    played.put_item("c", "three")
    played.put_item("a", "pop", tags=["calm"])
    played.client.delete("/v1/items/b")

    assert beliefs(played, "ann") == before
