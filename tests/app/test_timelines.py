"""How interest in an item has moved, slot by slot."""

from typing import Any

import pytest

from tests.app.clocks import later
from tests.app.commands import Encore
from tests.app.service import Service
from tests.app.test_retention import DAY, listen, prune
from tests.catalogues import paper_example
from tests.filter import Filter

SIGNALS = ("like", "skip", "like", "none", "skip")


def timeline(service: Service, item: str, **query: object) -> list[dict[str, Any]]:
    answer = service.client.get(
        f"/v1/users/ann/items/{item}/timeline",
        params={name: str(value) for name, value in query.items()},
    )
    assert answer.is_success, answer.text
    told = answer.json()
    assert (told["user"], told["item"]) == ("ann", item)
    points: list[dict[str, Any]] = told["timeline"]
    return points


def test_it_is_what_was_believed_as_each_slot_began(example: Service) -> None:
    oracle = Filter(paper_example(2))
    believed, likes, told = [], [], []
    item = "item-1"
    for number in range(12):
        if number % 4 == 3:
            signal, played = SIGNALS[number % 5], item
            form = {"item": played, "signal": signal}
            example.client.post("/v1/users/ann/plays", json=form).raise_for_status()
        else:
            play = example.next("ann")
            signal, played = SIGNALS[number % 5], play["item"]
            example.answer(play["play"], signal)
        believed.append(oracle.beliefs[item])
        likes.append(oracle.like(item))
        told.append([signal] if played == item else [])
        oracle.take(played, signal)
    [now] = example.beliefs("ann", item=item)["beliefs"]

    points = timeline(example, item)

    assert [point["slot"] for point in points] == list(range(13))
    assert [point["signals"] for point in points] == [*told, []]
    for point, belief, like in zip(points[:-1], believed, likes, strict=True):
        assert point["belief"] == pytest.approx(belief, abs=1e-9)
        assert point["like"] == pytest.approx(like, abs=1e-9)
    last = {name: points[-1][name] for name in ("belief", "like", "rested")}
    assert last == {name: now[name] for name in ("belief", "like", "rested")}
    assert timeline(example, item, slots=5) == points[-6:]


def test_it_shows_rest(example: Service) -> None:
    played = example.next("ann")
    example.answer(played["play"], "like")
    for _ in range(3):
        example.answer(example.next("ann", exclude=played["item"])["play"], "skip")

    points = timeline(example, played["item"])

    assert [point["rested"] for point in points] == [None, 0, 1, 2, 3]
    assert [point["signals"] for point in points] == [["like"], [], [], [], []]


def test_plays_of_one_slot_are_told_in_it(example: Service) -> None:
    plays = example.next("ann", count=3)["plays"]
    for play in reversed(plays):
        example.answer(play["play"], "like")

    for play in plays:
        points = timeline(example, play["item"])
        assert [point["signals"] for point in points] == [["like"], []]
        assert [point["rested"] for point in points] == [None, 0]


def test_it_begins_where_plays_were_dropped(example: Service, encore: Encore) -> None:
    example.set_policy("round_robin")
    listen(example, "ann", 12)
    later(example, "ann", 40 * DAY)
    oracle = Filter(paper_example(2))
    for _ in range(12):
        oracle.take_together({})
    prune(encore, example, 30)
    after_all = timeline(example, "item-1")
    new = listen(example, "ann", 4)

    points = timeline(example, "item-1")

    assert [point["slot"] for point in after_all] == [12]
    assert [point["slot"] for point in points] == [12, 13, 14, 15, 16]
    for number, play in enumerate(new):
        belief = oracle.beliefs["item-1"]
        assert points[number]["belief"] == pytest.approx(belief, abs=1e-9)
        oracle.take(play["item"], "skip" if number % 3 else "like")


def test_of_a_new_user_there_is_the_present(example: Service) -> None:
    [point] = timeline(example, "item-2")

    prior = paper_example(2)[1]["prior"]
    assert (point["slot"], point["rested"], point["signals"]) == (0, None, [])
    assert point["belief"] == pytest.approx(prior)


@pytest.mark.parametrize(
    ("path", "status", "code", "field"),
    [
        ("nothing/timeline", 404, "item_not_found", "item"),
        ("item-1/timeline?slots=0", 422, "invalid_request", "slots"),
        ("item-1/timeline?slots=1001", 422, "invalid_request", "slots"),
        ("item-1/timeline?slots=many", 422, "invalid_request", "slots"),
    ],
)
def test_wrong_input_is_told(
    example: Service, path: str, status: int, code: str, field: str
) -> None:
    answer = example.client.get(f"/v1/users/ann/items/{path}")

    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert [error["field"] for error in answer.json()["errors"]] == [field]
