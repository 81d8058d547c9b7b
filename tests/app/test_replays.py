"""Every decision can be taken again, bit for bit, whatever has changed since."""

from typing import Any

import pytest

from tests.app.replays import taken_again
from tests.app.service import Service
from tests.catalogues import SERIES, SIMPLE

POLICIES: list[tuple[str, dict[str, object]]] = [
    ("random", {}),
    ("round_robin", {}),
    ("myopic", {}),
    ("best_fixed", {}),
    ("rollout", {"trajectories": 20}),
    ("whittle_mc", {"trajectories": 20}),
    ("epsilon", {"epsilon": 0.5}),
    ("epsilon", {"policy": {"name": "random"}}),
    ("thompson", {"policy": {"name": "myopic"}}),
    ("rollout", {"base": "random", "reward": "click", "common_random_numbers": False}),
]


def test_decisions_can_be_taken_again_whatever_changed(example: Service) -> None:
    made = []
    for number, (policy, params) in enumerate(POLICIES):
        example.set_policy(policy, **params)
        example.put_item(f"extra-{number}", f"item-{number % 5 + 1}", tags=["extra"])
        example.put_model(
            "item-1", SIMPLE | {"prior": [0.1 * number, 1 - 0.1 * number]}
        )
        for signal in ("like", "skip", "none", "like"):
            filters = {"tag": "extra"} if signal == "skip" else {}
            made.append(example.next("ann", **filters))
            example.answer(made[-1]["play"], signal)
            report = {"item": "item-2", "signal": "like"}
            example.client.post("/v1/users/ann/plays", json=report)

    for play, again in taken_again(example, [play["play"] for play in made]):
        [shown] = [one for one in made if one["play"] == play]
        assert again == (shown["item"], shown["like"], shown["propensity"])


def test_decisions_of_signals_can_be_taken_again_without_them(
    service: Service,
) -> None:
    for name in ("one", "two"):
        service.put_model(name, SERIES)
        service.put_item(name, name)
    made = []
    for policy, signal in zip(
        ("myopic", "random") * 2, SERIES["signals"] * 2, strict=False
    ):
        service.set_policy(policy)
        made.append(service.next("ann"))
        service.answer(made[-1]["play"], signal)
    before = [explained(service, play["play"]) for play in made]

    service.put_model("one", SIMPLE)
    service.put_model("two", SERIES | {"signals": ["a", "b", "c"]})

    assert [explained(service, play["play"]) for play in made] == before
    assert before[-1]["groups"] == 2
    expected = [
        (play["play"], (play["item"], play["like"], play["propensity"]))
        for play in made
    ]
    assert taken_again(service, [play["play"] for play in made]) == expected


def test_a_play_that_was_reported_was_not_decided(example: Service) -> None:
    taken = example.client.post(
        "/v1/users/ann/plays", json={"item": "item-2", "signal": "like"}
    ).json()

    record = example.client.get(
        f"/v1/plays/{taken['play']}", params={"explain": True}
    ).json()
    assert record["explanation"] is None
    with pytest.raises(ValueError, match="was not recommended"):
        taken_again(example, [taken["play"]])


def explained(service: Service, play: str) -> dict[str, Any]:
    answer = service.client.get(f"/v1/plays/{play}", params={"explain": True})
    found: dict[str, Any] = answer.json()["explanation"]
    return found
