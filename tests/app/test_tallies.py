"""What the users of each arm do is counted, each play once."""

from collections import defaultdict
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any

import numpy as np
import pytest

from app.services import guard
from app.services.tallies import Terms, is_due
from app.storage import tallies
from tests.app.experimenting import (
    AT_ONCE,
    MYOPIC,
    RANDOM,
    arm,
    begin,
    counted,
    end,
    report,
    told,
)
from tests.app.guards import checks, run
from tests.app.service import Service
from tests.catalogues import SERIES

USERS = [f"user-{number}" for number in range(24)]
SIGNALS = ("like", "skip", "like", "none")


def by_hand(service: Service, users: list[str]) -> dict[str, dict[str, float]]:
    """The same, from the plays of each user as they are listed."""
    found: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    for user in users:
        plays = told(service.client.get(f"/v1/users/{user}/plays"))["plays"]
        met = [play for play in reversed(plays) if play["arm"] is not None]
        own = [play for play in met if play["arm"] == met[0]["arm"]]
        for play in own:
            total = found[play["arm"]]
            total["plays"] += 1
            total["answered"] += play["signal"] in {"like", "skip"}
            total["likes"] += play["signal"] == "like"
        if own:
            found[own[0]["arm"]]["users"] += 1
        for play in met:
            found[play["arm"]]["moved"] += play not in own
    return found


def listen(service: Service, plays: int = 4) -> None:
    for number, user in enumerate(USERS):
        play = service.next(user)
        for turn in range(plays + number % 3):
            signal = SIGNALS[(number + turn) % 4]
            play = service.answer(play["play"], signal, next=True)["next"]
        service.answer(play["play"], "skip")


def equal(found: dict[str, Any], expected: dict[str, float]) -> bool:
    return all(found[name] == expected[name] for name in expected)


def test_each_play_counts_once_however_many_processes_count(
    example: Service,
) -> None:
    example.answer(example.next("before")["play"], "like")
    begin(example, arm("a", 0.4, MYOPIC), arm("b", 0.4, RANDOM), holdout=0.2)
    listen(example)
    report_one = {"item": "item-1", "signal": "like"}
    example.client.post(f"/v1/users/{USERS[0]}/plays", json=report_one)

    arms = counted(example, times=4)
    listen(example, plays=2)
    arms = counted(example, times=4)
    again = counted(example)

    expected = by_hand(example, USERS)
    assert set(arms) == {"a", "b", "holdout"}
    for name, found in arms.items():
        assert equal(found, expected[name]), name
        assert found["like_rate"]["value"] == found["likes"] / found["answered"]
    assert again == arms
    assert sum(found["users"] for found in arms.values()) == len(USERS)


def test_who_changes_arms_counts_by_what_was_before(example: Service) -> None:
    begin(example, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM))
    listen(example)
    begin(example, arm("a", 0.1, MYOPIC), arm("b", 0.9, RANDOM))
    listen(example)

    arms = counted(example)

    expected = by_hand(example, USERS)
    assert expected["b"]["moved"] > 0
    for name, found in arms.items():
        assert equal(found, expected[name]), name
    assert "moved" in report(example)["warnings"][-1]


def test_versions_tell_of_the_whole_experiment_and_doubt_no_shares_that_changed(
    example: Service,
) -> None:
    begin(example, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM))
    listen(example)
    counted(example)
    begin(example, arm("a", 0.01, MYOPIC), arm("b", 0.99, RANDOM))
    listen(example, plays=1)

    arms = counted(example)
    first, latest = report(example, version=1), report(example)

    assert arms["a"]["users"] > 0
    assert latest["counted_until"] == first["counted_until"] is not None
    for shown in (first, latest):
        assert not [text for text in shown["warnings"] if "share:" in text]


def test_a_later_experiment_begins_at_nothing(example: Service) -> None:
    begin(example, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM))
    listen(example)
    last = end(example)["version"]
    listen(example)
    begin(example, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM), name="another")
    fresh = example.next("fresh")["play"]
    example.answer(fresh, "like")

    arms = counted(example)

    assert sum(found["plays"] for found in arms.values()) == 1
    before = report(example, version=last)["arms"]
    plays = sum(4 + number % 3 + 1 for number in range(len(USERS)))
    assert sum(found["plays"] for found in before) == plays


def test_rewards_of_signals_add_up(service: Service) -> None:
    service.put_model("series", SERIES)
    service.put_item("pilot", "series")
    begin(service, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM))
    for signal in ("partial", "none", "complete", "skip"):
        service.answer(service.next("ann")["play"], signal)

    [found] = [each for each in counted(service).values() if each["plays"]]

    assert (found["plays"], found["answered"]) == (4, 3)
    assert found["likes"] == pytest.approx(1.4)


@pytest.mark.parametrize("lag", [timedelta(minutes=30), timedelta.max])
def test_answers_are_waited_for_in_turn_so_that_skips_are_not_ahead(
    example: Service, lag: timedelta
) -> None:
    patient = Terms(lag, AT_ONCE.settle)
    begin(example, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM))
    slow = example.next("slow")["play"]
    example.answer(example.next("fast")["play"], "skip")

    waiting = counted(example, terms=patient)
    example.answer(slow, "like")
    answered = counted(example, terms=patient)

    assert sum(found["plays"] for found in waiting.values()) == 0
    assert sum(found["answered"] for found in answered.values()) == 2
    assert report(example)["counted_until"] is not None


def test_what_counts_and_checks_does_not_wait_for_a_clock_that_went_back(
    example: Service,
) -> None:
    begin(example, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM))
    example.answer(example.next("ann")["play"], "like")
    counted(example)
    checks(example)
    every = timedelta(seconds=15)

    for hours, due in ((0, False), (1, True), (-1, True)):
        now = datetime.now(UTC) + timedelta(hours=hours)
        count = partial(is_due, now=now, every=every, terms=AT_ONCE)
        check = partial(guard.is_due, now=now, every=every)
        assert run(example, count, check) == [due, due]


def test_nothing_is_kept_of_a_user_who_is_erased(example: Service) -> None:
    begin(example, arm("a", 0.5, MYOPIC), arm("b", 0.5, RANDOM))
    listen(example)
    arms = counted(example)

    for user in USERS[:5]:
        example.client.delete(f"/v1/users/{user}").raise_for_status()

    [kept] = run(example, lambda store: tallies.users(store, set(USERS)))
    assert {user.user_id for user in kept} == set(USERS[5:])
    assert counted(example) == arms


def test_a_better_policy_is_found_to_be_better(service: Service) -> None:
    """Half of the items are liked, and one of the arms knows which."""
    for name, like in (("good", 0.95), ("bad", 0.05)):
        even = [[0.5, 0.5]] * 2
        model = {"states": ["a", "b"], "play": even, "rest": even, "prior": [0.5, 0.5]}
        service.put_model(name, {**model, "like": [like, like]})
        service.put_item(name, name)
    begin(service, arm("any", 0.5, RANDOM), arm("knows", 0.5, MYOPIC))
    luck = np.random.default_rng(0)
    for number in range(140):
        play = service.next(f"user-{number}")
        for _ in range(3):
            signal = "like" if luck.random() < play["like"] else "skip"
            play = service.answer(play["play"], signal, next=True)["next"]

    arms = counted(service)

    better = arms["knows"]
    assert better["difference"]["p"] < 0.01
    assert better["difference"]["interval"][0] > 0
    assert better["like_rate"]["interval"][0] > arms["any"]["like_rate"]["value"]
    assert arms["any"]["difference"] is None
    assert report(service)["warnings"] == []

    begin(service, arm("any", 0.4, RANDOM), arm("knows", 0.4, MYOPIC), arm("c", 0.2))
    begin(service, arm("any", 0.5, RANDOM), arm("knows", 0.5, MYOPIC))
    [again] = [each for each in report(service)["arms"] if each["name"] == "knows"]
    before, after = better["difference"], again["difference"]
    assert (before["level"], after["level"]) == (0.05, 0.025)
    assert after["p"] == pytest.approx(2 * before["p"])
