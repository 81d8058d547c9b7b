"""Old plays are dropped: what is left is the log."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from tests.app.clocks import later
from tests.app.commands import Encore, Said
from tests.app.replays import taken_again
from tests.app.service import Service
from tests.app.test_audits import audit, rebuild
from tests.catalogues import SIMPLE, load, paper_example
from tests.filter import Filter

DAY = 86_400.0


def listen(service: Service, user: str, plays: int) -> list[dict[str, Any]]:
    found = []
    for number in range(plays):
        play = service.next(user)
        service.answer(play["play"], "skip" if number % 3 else "like")
        found.append(play)
    return found


def prune(encore: Encore, service: Service, days: float, *more: object) -> Said:
    """Drop what is older than some days."""
    before = datetime.now(UTC) - timedelta(days=days)
    at = ("--database-url", service.settings.database_url)
    told = f"{before:%Y-%m-%dT%H:%M:%S}"
    said = encore("prune", "--before", told, "--json", *more, *at)
    assert said.status == 0, said.err
    return said


def history(service: Service, user: str) -> list[str]:
    told = service.client.get(f"/v1/users/{user}/plays").json()["plays"]
    return [play["play"] for play in told][::-1]


@pytest.mark.parametrize("policy", ["myopic", "round_robin"])
def test_what_is_left_is_the_log(example: Service, encore: Encore, policy: str) -> None:
    example.set_policy(policy)
    old = listen(example, "ann", 12)
    later(example, "ann", 40 * DAY)
    new = listen(example, "ann", 5)
    listen(example, "bob", 3)
    pending = example.next("ann")

    counted = prune(encore, example, 30, "--dry-run").json
    assert counted == {"users": 1, "plays": 12, "dry_run": True}
    assert history(example, "ann") == [play["play"] for play in (*old, *new)]
    dropped = prune(encore, example, 30).json
    again = prune(encore, example, 30).json

    assert (dropped["users"], dropped["plays"], again["plays"]) == (1, 12, 0)
    assert history(example, "ann") == [play["play"] for play in new]
    assert example.next("ann")["play"] == pending["play"]
    slot = example.answer(pending["play"], "like")["slot"]
    assert slot == 18
    oracle = Filter(paper_example(2))
    for _ in old:  # nobody knows what was played then
        oracle.take_together({})
    for number, play in enumerate(new):
        oracle.take(play["item"], "skip" if number % 3 else "like")
    oracle.take(pending["item"], "like")
    held = example.beliefs("ann", item=[item["id"] for item in paper_example(2)])
    for each in held["beliefs"]:
        expected = oracle.beliefs[each["item"]]
        assert each["belief"] == pytest.approx(expected, abs=1e-9)
    assert [found.findings for found in audit(example)] == [[], []]
    rebuild(example)
    assert example.beliefs("ann", item="item-1")["slot"] == slot
    assert [found.findings for found in audit(example)] == [[], []]


def test_choices_are_explained_as_far_as_they_can_be(
    example: Service, encore: Encore
) -> None:
    listen(example, "ann", 4)
    later(example, "ann", 40 * DAY)
    [kept] = listen(example, "ann", 1)
    pending = example.next("ann", explain=True)
    assert pending["explanation"] is not None

    prune(encore, example, 30)

    assert example.next("ann", explain=True)["explanation"] is None
    path = f"/v1/plays/{kept['play']}"
    assert (
        example.client.get(path, params={"explain": True}).json()["explanation"] is None
    )
    example.answer(pending["play"], "like")
    fresh = example.next("ann", explain=True)
    [(_, again)] = taken_again(example, [fresh["play"]])
    assert fresh["explanation"] is not None
    assert again == (fresh["item"], fresh["like"], fresh["propensity"])


def test_a_user_of_whom_nothing_is_left_goes_on(
    example: Service, encore: Encore
) -> None:
    old = listen(example, "ann", 6)
    later(example, "ann", 40 * DAY)

    prune(encore, example, 30)

    assert history(example, "ann") == []
    gone = example.client.get(f"/v1/plays/{old[0]['play']}")
    assert gone.status_code == 404
    assert [found.findings for found in audit(example)] == [[]]
    rebuild(example)
    play = example.next("ann")
    assert (play["slot"], example.answer(play["play"], "like")["slot"]) == (6, 7)
    assert [found.findings for found in audit(example)] == [[]]
    export = example.client.get("/v1/users/ann/export").json()
    assert len(export["plays"]) == 1


def test_plays_that_share_a_slot_with_one_that_waits_stay(
    service: Service, encore: Encore
) -> None:
    load(service.client, [{"id": name, **SIMPLE} for name in ("a", "b", "c")])
    listen(service, "ann", 3)
    first, second = service.next("ann", count=2)["plays"]
    service.answer(first["play"], "like")
    later(service, "ann", 40 * DAY)

    assert prune(encore, service, 30).json["plays"] == 3

    assert history(service, "ann") == [first["play"]]
    service.answer(second["play"], "skip")
    assert [found.findings for found in audit(service)] == [[]]
