"""What is held about a user, plans, forecasts, and leaving."""

from typing import Any

import pytest

from tests.app.service import Service
from tests.catalogues import SIMPLE, paper_example
from tests.filter import Filter


def test_played_items_are_believed_in_and_step_as_they_rest(example: Service) -> None:
    oracle = Filter(paper_example(2))
    for item, signal in (("item-1", "like"), ("item-5", "skip"), ("item-4", "none")):
        report(example, "ann", item, signal)
        oracle.take(item, signal)

    held = example.beliefs("ann")

    assert held["slot"] == 3
    assert [(b["item"], b["rested"]) for b in held["beliefs"]] == [
        ("item-1", 2),
        ("item-4", 0),
        ("item-5", 1),
    ]
    for belief in held["beliefs"]:
        assert belief["states"] == ["L", "M", "H", "V"]
        assert belief["belief"] == pytest.approx(oracle.beliefs[belief["item"]])
        assert belief["like"] == pytest.approx(oracle.like(belief["item"]))


def test_beliefs_of_items_never_played_can_be_asked_for(example: Service) -> None:
    oracle = Filter(paper_example(2))
    report(example, "ann", "item-1", "like")
    oracle.take("item-1", "like")

    [belief] = example.beliefs("ann", item="item-2")["beliefs"]

    assert belief["rested"] is None
    assert belief["belief"] == pytest.approx(oracle.beliefs["item-2"])


def test_a_report_leaves_the_pending_play_pending(example: Service) -> None:
    play = example.next("ann")

    taken = report(example, "ann", "item-1", "like")

    assert taken["slot"] == 1
    assert example.next("ann") == play | {"pending": True, "slot": 1}
    assert example.answer(play["play"], "skip")["slot"] == 2
    oracle = Filter(paper_example(2))
    oracle.take("item-1", "like")
    oracle.take(play["item"], "skip")
    for belief in example.beliefs("ann")["beliefs"]:
        assert belief["belief"] == pytest.approx(oracle.beliefs[belief["item"]])


def test_a_key_used_for_two_reports_is_a_conflict(example: Service) -> None:
    headers = {"Idempotency-Key": "one"}
    path = "/v1/users/ann/plays"
    example.client.post(
        path, json={"item": "item-1", "signal": "like"}, headers=headers
    )

    refused = example.client.post(
        path, json={"item": "item-2", "signal": "like"}, headers=headers
    )

    assert refused.status_code == 409
    assert refused.json()["code"] == "idempotency_conflict"


def test_history_comes_in_pages_the_latest_first(example: Service) -> None:
    for number in range(7):
        report(example, "ann", f"item-{number % 5 + 1}", "like")

    slots, cursor = [], None
    while True:
        query = {"limit": 3} | ({} if cursor is None else {"cursor": cursor})
        page = example.client.get("/v1/users/ann/plays", params=query).json()
        slots.append([play["slot"] for play in page["plays"]])
        cursor = page["next"]
        if cursor is None:
            break

    assert slots == [[6, 5, 4], [3, 2, 1], [0]]


def test_a_playlist_changes_nothing_and_stays_the_same(example: Service) -> None:
    before = example.beliefs("ann")

    playlists = [
        example.client.get(
            "/v1/users/ann/playlist", params={"length": 8, "repeats": True}
        ).json()
        for _ in range(2)
    ]

    assert playlists[0] == playlists[1]
    assert [play["slot"] for play in playlists[0]["plays"]] == list(range(8))
    assert example.beliefs("ann") == before
    assert example.client.get("/v1/users/ann/plays").json()["plays"] == []


def test_a_playlist_is_what_myopic_plays_if_nothing_is_answered(
    example: Service,
) -> None:
    oracle = Filter(paper_example(2))
    planned = example.client.get(
        "/v1/users/ann/playlist", params={"length": 6, "repeats": True}
    ).json()

    for play in planned["plays"]:
        best = max(oracle.items, key=oracle.like)
        assert play["item"] == best
        assert play["like"] == pytest.approx(oracle.like(best))
        oracle.take(best, "none")


def test_another_policy_can_be_planned_by_and_is_not_put_in_force(
    example: Service,
) -> None:
    for item, signal in (("item-1", "like"), ("item-2", "skip"), ("item-3", "like")):
        report(example, "ann", item, signal)
    form = {"length": 6, "repeats": True}
    before = example.client.get("/v1/admin/policies").json()
    by_default = plan(example, **form)

    planned = {
        name: plan(example, **form, policy={"name": name, "params": params})
        for name, params in (
            ("myopic", {}),
            ("round_robin", {}),
            ("exact_rollout", {"base": "myopic", "depth": 2, "leaf": "none"}),
        )
    }

    assert planned["myopic"]["plays"] == by_default["plays"]
    assert by_default["policy"]["name"] == "myopic"
    items = {name: [p["item"] for p in plan["plays"]] for name, plan in planned.items()}
    assert items["round_robin"] != items["myopic"]
    for name, found in planned.items():
        assert found["policy"] == {"version": 0, "name": name}
        assert {play["rung"] for play in found["plays"]} == {0}
    assert example.client.get("/v1/admin/policies").json() == before
    assert example.next("ann")["policy"]["name"] == "myopic"


def test_a_plan_by_a_policy_that_is_none_names_the_field(example: Service) -> None:
    too_much = {"horizon": 50, "trajectories": 10_000}
    for policy, field in (
        ({"name": "nobody"}, "policy.name"),
        ({"name": "rollout", "params": {"horizon": -1}}, "policy.params.horizon"),
        ({"name": "rollout", "params": too_much}, "policy.params.trajectories"),
        ({"name": "myopic", "params": {"x": 1}}, "policy.params.x"),
    ):
        answer = example.client.post("/v1/users/ann/playlist", json={"policy": policy})

        assert answer.status_code == 422
        assert [fault["field"] for fault in answer.json()["errors"]] == [field]


def plan(service: Service, **form: object) -> dict[str, Any]:
    answer = service.client.post("/v1/users/ann/playlist", json=form)
    assert answer.is_success, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_a_playlist_plans_no_item_twice_and_ends_when_none_is_left(
    example: Service,
) -> None:
    pending = example.next("ann", candidate=["item-2"])

    planned = example.client.get(
        "/v1/users/ann/playlist", params={"length": 9, "exclude": "item-4"}
    ).json()["plays"]

    assert planned[0]["item"] == pending["item"]
    assert sorted(play["item"] for play in planned) == [
        "item-1",
        "item-2",
        "item-3",
        "item-5",
    ]
    assert [play["slot"] for play in planned] == [0, 1, 2, 3]


def test_a_playlist_begins_with_what_is_pending(example: Service) -> None:
    pending = example.next("ann", candidate=["item-2"])

    planned = example.client.get("/v1/users/ann/playlist", params={"length": 2}).json()[
        "plays"
    ]

    assert planned[0]["item"] == pending["item"] == "item-2"
    assert [play["pending"] for play in planned] == [True, False]


def test_a_forecast_tells_when_an_item_is_back(service: Service) -> None:
    tiring = SIMPLE | {"play": [[1.0, 0.0], [1.0, 0.0]]}  # a play ends all interest
    service.put_model("tiring", tiring)
    service.put_item("song", "tiring")
    report(service, "ann", "song", "like")

    seen = service.client.get(
        "/v1/users/ann/items/song/forecast", params={"slots": 6, "threshold": 0.5}
    ).json()

    # From low, interest is high after k slots of rest with chance .75 (1 - .6^k).
    expected = [0.2 + 0.6 * 0.75 * (1 - 0.6**k) for k in range(1, 7)]
    assert seen["like"] == pytest.approx(0.2)
    assert seen["rested"] == 0
    assert [point["like"] for point in seen["forecast"]] == pytest.approx(expected)
    assert seen["back_in"] == 3


def test_a_forecast_of_an_unknown_item_is_not_found(example: Service) -> None:
    answer = example.client.get("/v1/users/ann/items/nothing/forecast")

    assert answer.status_code == 404
    assert answer.json()["code"] == "item_not_found"


def test_all_that_is_held_can_be_exported_and_erased(example: Service) -> None:
    report(example, "ann", "item-1", "like")
    play = example.next("ann")
    report(example, "bob", "item-1", "skip")

    held = example.client.get("/v1/users/ann/export").json()

    assert held["slot"] == 1
    assert [p["signal"] for p in held["plays"]] == ["like", None]
    assert held["plays"][1]["play"] == play["play"]
    assert [belief["item"] for belief in held["beliefs"]] == ["item-1"]

    assert example.client.delete("/v1/users/ann").status_code == 204

    assert example.client.get("/v1/users/ann/export").status_code == 404
    assert example.client.delete("/v1/users/ann").status_code == 404
    assert example.client.get(f"/v1/plays/{play['play']}").status_code == 404
    assert example.beliefs("ann") == {
        "user": "ann",
        "slot": 0,
        "mood": None,
        "beliefs": [],
        "next": None,
    }
    assert example.beliefs("bob")["slot"] == 1


def test_a_play_is_explained_by_taking_its_decision_again(example: Service) -> None:
    example.set_policy("rollout", trajectories=50, reward="click")
    play = example.next("ann")
    fresh = example.client.get("/v1/users/ann/next", params={"explain": True}).json()
    example.answer(play["play"], "like", next=True)
    example.set_policy("random")
    example.put_item("item-6", "item-1")
    example.client.delete("/v1/items/item-3")

    later = example.client.get(
        f"/v1/plays/{play['play']}", params={"explain": True}
    ).json()

    assert later["explanation"] == fresh["explanation"]
    candidates = later["explanation"]["candidates"]
    assert candidates[0]["item"] == play["item"]
    assert candidates[0]["like"] == play["like"]
    assert later["explanation"]["groups"] == len(candidates) == 5
    assert later["explanation"]["runner_up"] == candidates[1]
    assert candidates[0]["score"] == max(group["score"] for group in candidates)


def report(service: Service, user: str, item: str, signal: str) -> dict[str, object]:
    answer = service.client.post(
        f"/v1/users/{user}/plays", json={"item": item, "signal": signal}
    )
    assert answer.status_code == 201, answer.text
    taken: dict[str, object] = answer.json()
    return taken
