"""Which policies there are, and how those did that were chosen."""

import pytest

from app.services import overviews
from tests.app.service import Service


def test_plays_count_for_the_policy_that_chose_them(example: Service) -> None:
    answers = {"myopic": ("like", "like", "skip"), "random": ("skip", "none", "like")}
    expected = dict.fromkeys(answers, 0.0)
    for name, signals in answers.items():
        example.set_policy(name)
        for number, signal in enumerate(signals):
            play = example.next(f"{name}-{number % 2}")
            expected[name] += play["like"] if signal != "none" else 0.0
            example.answer(play["play"], signal)
    report = {"item": "item-1", "signal": "like"}
    example.client.post("/v1/users/alone/plays", json=report).raise_for_status()

    told = example.client.get("/v1/admin/overview", params={"hours": 1, "buckets": 6})

    courses = {one["name"]: one for one in told.json()["policies"]}
    for name, signals in answers.items():
        course = courses[name]
        assert (course["plays"], course["users"]) == (3, 2)
        assert course["likes"] == signals.count("like")
        assert course["answered"] == 3 - signals.count("none")
        assert course["expected"] == pytest.approx(expected[name])
        assert sum(bucket["plays"] for bucket in course["buckets"]) == 3
        assert all(one["at"] < told.json()["until"] for one in course["buckets"])
    assert courses[None]["plays"] == 1
    assert told.json()["bucket_s"] == 600.0


def test_who_asks_a_moment_later_is_told_the_same(
    example: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    def told(**query: float) -> tuple[str, int]:
        answer = example.client.get("/v1/admin/overview", params=query).json()
        return answer["until"], sum(one["plays"] for one in answer["policies"])

    monkeypatch.setattr(overviews, "FRESH", 3600.0)
    first = told()
    example.next("ann")

    assert told() == first
    assert told(hours=2)[1] == 1
    monkeypatch.setattr(overviews, "FRESH", -1.0)
    assert told(hours=3)[1] == 1
    example.next("ben")
    assert told(hours=3)[1] == 2


def test_of_many_plays_the_latest_are_told(
    example: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(overviews, "MOST", 4)
    monkeypatch.setattr(overviews, "PAGE", 2)
    plays = [example.next(f"user-{number}") for number in range(7)]
    for play in plays:
        example.answer(play["play"], "like")

    told = example.client.get("/v1/admin/overview").json()

    [course] = told["policies"]
    assert (course["plays"], course["users"]) == (4, 4)
    first = example.client.get(f"/v1/plays/{plays[3]['play']}").json()["created_at"]
    assert told["since"][:19] == first[:19]


@pytest.mark.parametrize(
    ("query", "field"),
    [({"hours": 0}, "hours"), ({"hours": "NaN"}, "hours"), ({"buckets": 0}, "buckets")],
)
def test_a_span_that_is_none_is_refused(
    example: Service, query: dict[str, str], field: str
) -> None:
    answer = example.client.get("/v1/admin/overview", params=query)

    assert answer.status_code == 422
    assert [fault["field"] for fault in answer.json()["errors"]] == [field]


def test_the_policies_there_are_can_all_be_put_in_force_as_they_are_listed(
    example: Service,
) -> None:
    listed = example.client.get("/v1/policies").json()["policies"]

    for policy in listed:
        given = {
            name: one["default"]
            for name, one in policy["params"]["properties"].items()
            if "default" in one
        }
        answer = example.client.put(
            "/v1/admin/policy", json={"name": policy["name"], "params": given}
        )
        assert answer.status_code == 200, answer.text
        assert policy["summary"]
    assert {"myopic", "exact_rollout", "whittle"} <= {one["name"] for one in listed}
