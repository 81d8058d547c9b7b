"""Experiments beside what else watches over policies: the guard, and index tables."""

from typing import Any

from tests.app.experimenting import (
    EXPERIMENT,
    RANDOM,
    arm,
    arms_of,
    begin,
    counted,
    end,
    report,
)
from tests.app.guards import TIRING, WRONG, Listeners, checks, judged, until_fallen
from tests.app.guards import report as guard_report
from tests.app.indexes import report as index_report
from tests.app.service import Service
from tests.catalogues import SIMPLE

BEST: dict[str, Any] = {"name": "best_fixed", "params": {}}
WHITTLE: dict[str, Any] = {"name": "whittle", "params": {"discount": 0.9}}


def test_the_guards_fallback_wins_and_the_experiment_goes_on_after_it(
    service: Service,
) -> None:
    """Nobody is served by the policy in force: it is arms that bring the alarm."""
    listeners = Listeners(service)
    listeners.open(WRONG, "random")
    users = [f"user-{number}" for number in range(listeners.users)]
    begin(service, arm("best", 0.5, BEST), arm("myopic", 0.5, {"name": "myopic"}))
    before = arms_of(service, users)

    until_fallen(listeners)
    listeners.listen(1)  # what had been chosen before
    told, plays = report(service), counted(service)
    listeners.listen(2)
    served = [service.next(user) for user in users]
    records = [
        service.client.get(f"/v1/plays/{play['play']}").json() for play in served
    ]
    meanwhile = counted(service)
    service.put_model("pop", TIRING)
    for _ in range(40):
        listeners.listen(3)
        if any(check.replaced for check in checks(service)):
            break
    listeners.listen(1)

    assert set(before.values()) == {"best", "myopic"}
    assert told["suspended"]
    assert "guard" in told["warnings"][0]
    assert {play["policy"]["name"] for play in served} == {"round_robin"}
    assert {(play["experiment"], play["arm"]) for play in records} == {(None, None)}
    assert meanwhile == plays
    assert arms_of(service, users) == before
    assert not report(service)["suspended"]
    assert judged(service)["state"] == "calm"


def test_an_experiment_that_ends_or_begins_is_judged_anew(service: Service) -> None:
    listeners = Listeners(service)
    listeners.open(TIRING)
    listeners.listen(5)
    checks(service)
    before = judged(service)
    begun = begin(service, arm("as-ever", 0.5), arm("any", 0.5, RANDOM))
    listeners.listen(3)
    checks(service)
    during = judged(service)
    end(service)
    listeners.listen(4)
    checks(service)
    after = judged(service)

    own = begun["arms"][1]["policy"]["version"]
    assert (before["policy"], before["answers"]) == (2, 50)
    assert (during["policy"], during["answers"]) == (own, 30)
    assert after["policy"] == 2
    assert 30 <= after["answers"] < 40  # without what the arm had chosen
    assert guard_report(service)["policy"] == 2


def test_arms_have_their_index_tables_at_once(service: Service) -> None:
    for number in range(3):
        service.put_model(f"model-{number}", SIMPLE)
        service.put_item(f"item-{number}", f"model-{number}")
    service.set_policy("myopic")
    begin(service, arm("as-ever", 0.5), arm("index", 0.5, WHITTLE))
    service.put_model("late", SIMPLE)
    service.put_item("late", "late")

    plays = [service.next(f"user-{number}") for number in range(20)]

    for model in ("model-0", "late"):
        told = index_report(service.client, model, discount=0.9)
        assert (told["state"], told["precision"]) == ("waiting", "rough")
    assert {play["policy"]["name"] for play in plays} == {"myopic", "whittle"}
    for play in plays:
        record = service.client.get(f"/v1/plays/{play['play']}").json()
        assert record["rung"] == 0


def test_an_arm_that_can_choose_nothing_is_refused(service: Service) -> None:
    even = [1 / 22] * 22
    service.set_policy("myopic")
    service.put_model(
        "large",
        {
            "states": [f"s{number}" for number in range(22)],
            "play": [even] * 22,
            "rest": [even] * 22,
            "like": [number / 22 for number in range(22)],
            "prior": even,
        },
    )

    arms = [arm("as-ever", 0.5), arm("index", 0.5, WHITTLE)]
    refused = service.client.put(EXPERIMENT, json={"name": "trial", "arms": arms})
    shadow = {"name": "index", "policy": WHITTLE}
    shade = service.client.put(EXPERIMENT, json={"name": "x", "shadows": [shadow]})

    for answer in (refused, shade):
        assert (answer.status_code, answer.json()["code"]) == (409, "too_many_states")
    assert service.client.get(EXPERIMENT).status_code == 404
    assert service.set_policy("random")["version"] == 3
