"""Several plays in one slot: each is a play of its own, with its own answer."""

from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from itertools import permutations
from typing import Any

import pytest

from app.settings import Settings
from tests.app.replays import taken_again
from tests.app.service import Service
from tests.app.test_audits import audit, rebuild
from tests.catalogues import SIMPLE, load, paper_example
from tests.filter import Filter

Slate = Sequence[dict[str, Any]]

SLOW: dict[str, Any] = {  # an answer hardly possible makes much of next to nothing
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.1, 0.9]],
    "rest": [[1.0, 0.0], [0.1, 0.9]],
    "like": [1e-6, 1.0],
    "prior": [1.0, 0.0],
}


def test_an_index_plays_its_best_items_together(example: Service) -> None:
    oracle = Filter(paper_example(2))
    report(example, "ann", "item-3", "skip")
    oracle.take("item-3", "skip")
    best = sorted(oracle.items, key=oracle.like, reverse=True)

    slate = example.next("ann", count=3)

    assert [play["item"] for play in slate["plays"]] == best[:3]
    assert [play["place"] for play in slate["plays"]] == [0, 1, 2]
    assert [play["propensity"] for play in slate["plays"]] == [1.0, 1.0, 1.0]
    assert len({play["play"] for play in slate["plays"]}) == 3
    for play in slate["plays"]:
        assert play["like"] == pytest.approx(oracle.like(play["item"]))
        kept = example.client.get(f"/v1/plays/{play['play']}").json()
        assert (kept["slate"], kept["place"]) == (slate["play"], play["place"])
        assert (kept["decided_slot"], kept["slot"]) == (1, None)
    assert slate["slot"] == 1
    assert slate["item"] == best[0]
    assert not slate["pending"]


def test_one_play_is_shown_as_ever(example: Service) -> None:
    one = example.next("ann", count=1)

    assert "plays" not in one
    assert example.next("ann") == one | {"pending": True}
    kept = example.client.get(f"/v1/plays/{one['play']}").json()
    assert (kept["slate"], kept["place"]) == (one["play"], 0)
    [alone] = example.next("ann", count=2)["plays"]
    assert alone["play"] == one["play"]


def test_a_slate_is_as_long_as_there_are_items(example: Service) -> None:
    slate = example.next("ann", count=50, exclude="item-2")

    assert {play["item"] for play in slate["plays"]} == {
        "item-1",
        "item-3",
        "item-4",
        "item-5",
    }
    listed = example.client.post("/v1/users/bob/next", json={"count": 2.0}).json()
    assert len(listed["plays"]) == 2


@pytest.mark.parametrize("count", [0, 51, 2.5, "two", True])
def test_other_counts_are_refused(example: Service, count: object) -> None:
    asked = example.client.get("/v1/users/ann/next", params={"count": str(count)})
    sent = example.client.post("/v1/users/ann/next", json={"count": count})

    assert (asked.status_code, sent.status_code) == (422, 422)


def test_answers_in_any_order_teach_the_same(example: Service) -> None:
    signals = ("like", "skip", "none")
    oracle = Filter(paper_example(2))
    held = []
    for user, order in enumerate(permutations(range(3))):
        slate = example.next(f"user-{user}", count=3)["plays"]
        for number, place in enumerate(order):
            taken = example.answer(slate[place]["play"], signals[place])
            assert taken["slot"] == 1
            assert example.beliefs(f"user-{user}")["slot"] == 1
            assert len(example.beliefs(f"user-{user}")["beliefs"]) == number + 1
        held.append(example.beliefs(f"user-{user}")["beliefs"])

    items = [play["item"] for play in example.next("another", count=3)["plays"]]
    oracle.take_together(dict(zip(items, signals, strict=True)))
    assert held == held[:1] * 6
    as_expected(example, "user-0", oracle)
    intact(example)


def test_what_still_waits_is_returned_whatever_is_asked_for(example: Service) -> None:
    slate = example.next("ann", count=3)
    first, second, third = slate["plays"]

    taken = example.answer(second["play"], "like", next=True, count=2)

    assert taken["slot"] == 1
    assert taken["next"]["slot"] == 0
    assert taken["next"]["plays"] == [first, third]
    assert example.next("ann", count=5) == taken["next"]
    assert example.next("ann") == taken["next"] | {"pending": True}
    last = example.answer(first["play"], "skip", next=True)
    assert last["next"]["play"] == third["play"]
    assert "plays" not in last["next"]
    over = example.answer(third["play"], "none", next=True, count=2)
    assert (over["slot"], over["next"]["slot"]) == (1, 1)
    assert not over["next"]["pending"]
    assert len(over["next"]["plays"]) == 2


def test_each_answer_counts_exactly_once(example: Service) -> None:
    slate = example.next("ann", count=5)["plays"]
    answers = [(play["play"], signal) for play in slate for signal in ("like", "skip")]

    def send(answer: tuple[str, str]) -> tuple[int, str]:
        play, signal = answer
        sent = example.client.post(
            f"/v1/plays/{play}/feedback", json={"signal": signal}
        )
        return sent.status_code, play

    with ThreadPoolExecutor(10) as threads:
        statuses = list(threads.map(send, answers))

    assert Counter(statuses) == Counter(
        (status, play["play"]) for play in slate for status in (200, 409)
    )
    assert example.beliefs("ann")["slot"] == 1
    for play in slate:
        signal = example.client.get(f"/v1/plays/{play['play']}").json()["signal"]
        again = example.answer(play["play"], signal)
        assert (again["slot"], again["repeated"]) == (1, True)
    intact(example)


def test_what_is_left_unanswered_counts_as_none_in_its_slot(settings: Settings) -> None:
    service = Service.start(
        settings.with_changes(pending_ttl=timedelta(microseconds=1))
    )
    try:
        load(service.client, paper_example(2))
        service.set_policy("myopic")
        oracle = Filter(paper_example(2))
        slate = service.next("ann", count=3)["plays"]
        items = [play["item"] for play in slate]
        service.answer(slate[1]["play"], "like")
        report(service, "ann", items[2], "skip")

        following = service.next("ann", count=2)

        # The item that was reported meanwhile has a slot of its own.
        oracle.take_together({items[0]: "none", items[1]: "like"})
        oracle.take(items[2], "skip")
        oracle.take(items[2], "none")
        assert following["slot"] == 3
        assert [shown(play) for play in history(service, "ann")] == [
            (0, items[0], "none"),
            (0, items[1], "like"),
            (1, items[2], "skip"),
            (2, items[2], "none"),
        ]
        as_expected(service, "ann", oracle)
        service.next("ann")  # none of them was answered: all share a slot
        assert service.beliefs("ann")["slot"] == 4
        intact(service)
    finally:
        service.stop()


def test_a_report_does_not_disturb_a_slate(example: Service) -> None:
    oracle = Filter(paper_example(2))
    slate = example.next("ann", count=3)["plays"]
    first, second, third = (play["item"] for play in slate)
    fourth = next(name for name in oracle.items if name not in {first, second, third})

    before = report(example, "ann", second, "like")
    waiting = example.next("ann", count=3)
    example.answer(slate[0]["play"], "skip")
    between = [report(example, "ann", item, "skip") for item in (fourth, third)]
    half = example.next("ann")
    late = [
        example.answer(slate[1]["play"], "like"),
        example.answer(slate[2]["play"], "like"),
    ]

    assert before["slot"] == 1
    assert waiting["slot"] == half["slot"] == 1
    assert [taken["slot"] for taken in between] == [3, 4]
    assert [taken["slot"] for taken in late] == [2, 5]  # its item has moved past
    oracle.take(second, "like")
    oracle.take_together({first: "skip", second: "like"})
    for item, signal in ((fourth, "skip"), (third, "skip"), (third, "like")):
        oracle.take(item, signal)
    as_expected(example, "ann", oracle)
    assert example.next("ann")["slot"] == 5
    intact(example)


@pytest.mark.parametrize("replaced", [False, True])
def test_what_waits_is_not_forgotten_while_other_slots_pass(
    service: Service, *, replaced: bool
) -> None:
    """Nor is what is played again meanwhile remembered for longer than by a rebuild."""
    service.put_model("slow", SLOW)
    for item in ("early", "late", "again", "other"):
        service.put_item(item, "slow")
        report(service, "ann", item, "none")
    for _ in range(250):
        report(service, "ann", "other", "none")
    slate = {
        play["item"]: play["play"]
        for play in service.next("ann", count=3, exclude="other")["plays"]
    }

    service.answer(slate["again"], "none")
    for _ in range(260):
        report(service, "ann", "other", "none")
    intact(service)
    if replaced:
        service.put_model("slow", SLOW | {"like": [1e-6, 0.99]})
    for item in ("again", "late"):
        report(service, "ann", item, "like")
    for item in ("early", "late"):
        service.answer(slate[item], "like")
        assert [one.findings for one in audit(service)] == [[]]

    slots = [shown(play) for play in history(service, "ann") if play["slot"] != 254]
    assert slots[-1] == (517, "late", "like")
    intact(service)


@pytest.mark.parametrize(
    ("policy", "params"),
    [
        ("random", {}),
        ("round_robin", {}),
        ("best_fixed", {}),
        ("rollout", {"trajectories": 20}),
    ],
)
def test_the_decision_on_each_place_can_be_taken_again(
    example: Service, policy: str, params: Mapping[str, object]
) -> None:
    for number in range(3):
        example.put_item(f"same-{number}", "item-1")
    for item in ("item-1", "item-4", "same-1"):
        report(example, "ann", item, "like")
    example.set_policy(policy, **params)
    slate = example.next("ann", count=6, explain=True)["plays"]
    for play in slate[::-1]:
        example.answer(play["play"], "skip")
    example.set_policy("myopic")
    example.client.delete("/v1/items/item-3")

    seeds = set()
    for place, play in enumerate(slate):
        record = example.client.get(
            f"/v1/plays/{play['play']}", params={"explain": True}
        ).json()
        seeds.add(record["seed"])
        explanation = record["explanation"]
        assert explanation == play["explanation"]
        candidates = explanation["candidates"]
        assert sum(group["count"] for group in candidates) == 8 - place
        named = {group["item"] for group in candidates}
        assert not named & {before["item"] for before in slate[:place]}
        assert candidates[0]["score"] == max(group["score"] for group in candidates)
    assert len(seeds) == 1
    again = taken_again(example, [play["play"] for play in slate])
    assert again == [
        (play["play"], (play["item"], play["like"], play["propensity"]))
        for play in slate
    ]


def test_propensities_are_what_counting_finds(service: Service) -> None:
    service.put_model("same", SIMPLE)
    for number in range(5):
        service.put_item(f"song-{number}", "same")
    service.set_policy("random")

    listeners = 400
    counted: Counter[tuple[int, str]] = Counter()
    pairs: Counter[tuple[str, str]] = Counter()
    for listener in range(listeners):
        report(service, f"user-{listener}", "song-0", "like")
        slate = service.next(f"user-{listener}", count=3)["plays"]
        assert [play["propensity"] for play in slate] == [1 / 5, 1 / 4, 1 / 3]
        counted.update((play["place"], play["item"]) for play in slate)
        pairs[slate[0]["item"], slate[1]["item"]] += 1

    assert len(counted) == 15
    assert len(pairs) == 20
    for times, chance in (
        *((times, 1 / 5) for times in counted.values()),
        *((times, 1 / 20) for times in pairs.values()),
    ):
        spread = (listeners * chance * (1 - chance)) ** 0.5
        assert abs(times - listeners * chance) < 4.5 * spread


def test_what_is_kept_of_a_slate_can_be_paged_exported_and_erased(
    example: Service,
) -> None:
    for _ in range(2):
        for play in example.next("ann", count=3)["plays"]:
            example.answer(play["play"], "like")
    waiting = example.next("ann", count=2)["plays"]

    plays = history(example, "ann", limit=2)
    held = example.client.get("/v1/users/ann/export").json()

    assert [play["slot"] for play in plays] == [0, 0, 0, 1, 1, 1]
    assert [play["place"] for play in plays] == [0, 1, 2, 0, 1, 2]
    assert held["plays"][:6] == plays
    assert [play["play"] for play in held["plays"][6:]] == [
        play["play"] for play in waiting
    ]
    assert example.client.delete("/v1/users/ann").status_code == 204
    for play in (*plays, *waiting):
        assert example.client.get(f"/v1/plays/{play['play']}").status_code == 404
    assert example.next("ann")["slot"] == 0


def test_a_plan_begins_with_the_plays_that_wait(example: Service) -> None:
    slate = example.next("ann", count=3)["plays"]
    example.answer(slate[0]["play"], "like")
    report(example, "ann", slate[0]["item"], "like")

    planned = example.client.get("/v1/users/ann/playlist").json()["plays"]

    assert [(play["slot"], play["pending"]) for play in planned] == [
        (0, True),
        (0, True),
        (2, False),
        (3, False),
        (4, False),
    ]
    assert [play["item"] for play in planned[:2]] == [p["item"] for p in slate[1:]]
    assert len({play["item"] for play in planned}) == 5


def report(service: Service, user: str, item: str, signal: str) -> dict[str, Any]:
    answer = service.client.post(
        f"/v1/users/{user}/plays", json={"item": item, "signal": signal}
    )
    assert answer.status_code == 201, answer.text
    taken: dict[str, Any] = answer.json()
    return taken


def history(service: Service, user: str, limit: int = 1000) -> list[dict[str, Any]]:
    """Closed plays, the earliest first."""
    found: list[dict[str, Any]] = []
    query: dict[str, str | int] = {"limit": limit}
    while True:
        page = service.client.get(f"/v1/users/{user}/plays", params=query).json()
        found += page["plays"]
        if page["next"] is None:
            return found[::-1]
        query["cursor"] = page["next"]


def shown(play: dict[str, Any]) -> tuple[int, str, str]:
    return play["slot"], play["item"], play["signal"]


def as_expected(service: Service, user: str, oracle: Filter) -> None:
    for belief in service.beliefs(user)["beliefs"]:
        assert belief["belief"] == pytest.approx(
            oracle.beliefs[belief["item"]], abs=1e-12
        )


def intact(service: Service) -> None:
    """What is kept is what the log says, and what a rebuild makes of it."""
    audited = audit(service)
    held = [service.beliefs(one.user) for one in audited]

    assert [one.findings for one in audited] == [[]] * len(audited)
    rebuild(service)
    assert [one.findings for one in audit(service)] == [[]] * len(audited)
    for one, before in zip(audited, held, strict=True):
        after = service.beliefs(one.user)
        assert after["slot"] == before["slot"]
        for belief, again in zip(before["beliefs"], after["beliefs"], strict=True):
            assert again["item"] == belief["item"]
            assert again["rested"] == belief["rested"]
            assert again["belief"] == pytest.approx(belief["belief"], abs=1e-9)
