"""The loop of next and feedback."""

from collections import Counter
from datetime import timedelta
from urllib.parse import quote

import pytest

from app.settings import Settings
from tests.app.service import Service
from tests.catalogues import SIMPLE


def test_next_is_repeated_until_it_is_answered(example: Service) -> None:
    first = example.next("ann")
    again = example.next("ann")

    assert not first["pending"]
    assert again == first | {"pending": True}


def test_answers_are_never_cached(example: Service) -> None:
    answer = example.client.get("/v1/users/ann/next")

    assert answer.headers["cache-control"] == "no-store"


def test_an_answer_opens_the_next_slot(example: Service) -> None:
    play = example.next("ann")

    taken = example.answer(play["play"], "like")

    assert play["slot"] == 0
    assert taken == {
        "play": play["play"],
        "signal": "like",
        "slot": 1,
        "repeated": False,
        "next": None,
    }
    assert example.next("ann")["slot"] == 1


def test_myopic_plays_what_is_liked_most(example: Service) -> None:
    play = example.next("ann")

    assert play["item"] == "item-3"
    assert play["like"] == pytest.approx(0.525)
    assert play["propensity"] == 1.0


def test_the_same_answer_again_changes_nothing(example: Service) -> None:
    play = example.next("ann")["play"]
    first = example.answer(play, "skip")
    before = example.beliefs("ann")

    second = example.answer(play, "skip")

    assert second == first | {"repeated": True}
    assert example.beliefs("ann") == before


def test_a_different_answer_is_a_conflict(example: Service) -> None:
    play = example.next("ann")["play"]
    example.answer(play, "like")

    refused = example.client.post(f"/v1/plays/{play}/feedback", json={"signal": "skip"})

    assert refused.status_code == 409
    assert refused.json()["code"] == "feedback_conflict"
    assert example.beliefs("ann")["slot"] == 1


@pytest.mark.parametrize(
    ("fraction", "signal"), [(0.0, "skip"), (0.79, "skip"), (0.8, "like"), (1, "like")]
)
def test_a_fraction_is_a_signal(example: Service, fraction: float, signal: str) -> None:
    play = example.next("ann")["play"]

    taken = example.client.post(
        f"/v1/plays/{play}/feedback", json={"fraction": fraction}
    )

    assert taken.json()["signal"] == signal


def test_feedback_can_bring_the_next_play(example: Service) -> None:
    play = example.next("ann")["play"]

    taken = example.answer(play, "like", next=True)

    assert taken["next"]["slot"] == 1
    assert not taken["next"]["pending"]
    assert example.next("ann") == taken["next"] | {"pending": True}


def test_repeated_feedback_brings_the_play_that_is_pending(example: Service) -> None:
    play = example.next("ann")["play"]
    following = example.answer(play, "like", next=True)["next"]

    again = example.answer(play, "like", next=True)

    assert again["repeated"]
    assert again["next"] == following | {"pending": True}


def test_feedback_is_kept_where_nothing_is_left_to_play(example: Service) -> None:
    play = example.next("ann")["play"]
    for number in range(1, 6):
        example.client.delete(f"/v1/items/item-{number}")

    taken = example.answer(play, "like", next=True)

    assert taken["slot"] == 1
    assert taken["next"] is None
    refused = example.client.get("/v1/users/ann/next")
    assert refused.status_code == 409
    assert refused.json()["code"] == "nothing_to_play"


def test_filters_leave_what_they_say(example: Service) -> None:
    for number, tags in enumerate((["a"], ["a", "b"], ["b"]), start=1):
        example.put_item(f"item-{number}", f"item-{number}", tags=tags)
    cases = {
        "both-tags": ({"tag": ["a", "b"]}, {"item-2"}),
        "candidates": ({"candidate": ["item-4", "item-5"]}, {"item-4", "item-5"}),
        "tag-without": ({"tag": ["a"], "exclude": ["item-2"]}, {"item-1"}),
        "all-but": ({"exclude": ["item-3"]}, {"item-5"}),
    }

    for user, (filters, allowed) in cases.items():
        assert example.next(user, **filters)["item"] in allowed


def test_filters_that_name_unknown_items_are_told_so(example: Service) -> None:
    refused = example.client.post(
        "/v1/users/ann/next",
        json={"candidate": ["item-1", "nothing"], "exclude": []},
    )

    assert refused.status_code == 422
    assert refused.json()["code"] == "unknown_item"
    [fault] = refused.json()["errors"]
    assert (fault["field"], fault["value"]) == ("candidate.1", "nothing")


def test_a_misspelt_filter_is_refused(example: Service) -> None:
    refused = example.client.get("/v1/users/ann/next", params={"tags": "calm"})

    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "tags"


@pytest.mark.parametrize(
    "filters",
    [{"tag": ["none-has-it"]}, {"candidate": ["item-1"], "exclude": ["item-1"]}],
)
def test_an_empty_choice_is_a_conflict(
    example: Service, filters: dict[str, list[str]]
) -> None:
    refused = example.client.get("/v1/users/ann/next", params=filters)

    assert refused.status_code == 409
    assert refused.json()["code"] == "nothing_to_play"
    assert example.beliefs("ann")["slot"] == 0


def test_a_catalogue_of_equals_is_spread_evenly(service: Service) -> None:
    service.put_model("same", SIMPLE)
    for number in range(4):
        service.put_item(f"song-{number}", "same")
    service.set_policy("myopic")

    played: Counter[str] = Counter()
    for listener in range(200):
        play = service.next(f"user-{listener}")
        played[play["item"]] += 1
        assert play["propensity"] == 0.25

    assert min(played.values()) >= 25  # a chance of 1e-5 to fail if it is even


def test_round_robin_plays_each_item_in_turn(service: Service) -> None:
    service.put_model("same", SIMPLE)
    for number in range(7):
        service.put_item(f"song-{number}", "same")
    service.set_policy("round_robin")
    play = service.next("ann")
    order = []

    for _ in range(21):
        order.append(play["item"])
        play = service.answer(play["play"], "like", next=True)["next"]

    assert set(order[:7]) == {f"song-{number}" for number in range(7)}
    assert order == order[:7] * 3


def test_a_play_left_unanswered_counts_as_none(settings: Settings) -> None:
    hasty = settings.with_changes(pending_ttl=timedelta(microseconds=1))
    service = Service.start(hasty)
    try:
        service.put_model("same", SIMPLE)
        service.put_item("song", "same")
        first = service.next("ann")

        second = service.next("ann")

        assert second["play"] != first["play"]
        assert second["slot"] == 1
        [closed] = service.client.get("/v1/users/ann/plays").json()["plays"]
        assert (closed["play"], closed["signal"]) == (first["play"], "none")
        late = service.client.post(
            f"/v1/plays/{first['play']}/feedback", json={"signal": "like"}
        )
        assert late.status_code == 409
    finally:
        service.stop()


def test_ids_may_hold_any_visible_character(service: Service) -> None:
    service.put_model("same", SIMPLE)
    name = "a/b?c#d%2F&=+é名🎵"
    service.client.put(f"/v1/items/{quote(name, safe='')}", json={"model": "same"})

    play = service.client.get(f"/v1/users/{quote(name, safe='')}/next").json()

    assert (play["user"], play["item"]) == (name, name)


@pytest.mark.parametrize("name", ["a b", "a\tb", "a\u200bb", "a\u0000b", "x" * 129])
def test_other_ids_are_refused(service: Service, name: str) -> None:
    refused = service.client.get(f"/v1/users/{quote(name, safe='')}/next")

    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "user"
