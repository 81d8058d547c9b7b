"""What can be earned from a new user, asked of the service."""

import httpx
import pytest

from tests.app.service import Service
from tests.catalogues import SIMPLE


def bound(client: httpx.Client, **query: float) -> httpx.Response:
    return client.get("/v1/admin/bound", params=query)


def test_the_bound_of_example_2_is_its_optimum(example: Service) -> None:
    told = bound(example.client, depth=2).json()

    assert 8.986321013 < told["bound"] < 8.98633
    assert told["best_fixed"]["model"] == "item-4"
    assert told["best_fixed"]["value"] == pytest.approx(8.9508, abs=5e-5)
    assert told["gap"] == pytest.approx(told["bound"] - told["best_fixed"]["value"])
    assert told["gap_percent"] == pytest.approx(100 * told["gap"] / told["bound"])
    assert (told["discount"], told["depth"]) == (0.95, 2)
    assert (told["models"], told["items"]) == (5, 5)


def test_more_look_ahead_lowers_the_bound(example: Service) -> None:
    told = [bound(example.client, depth=depth).json() for depth in (0, 1)]

    assert told[0]["bound"] == pytest.approx(9.09496, abs=1e-3)
    assert 8.986321013 < told[1]["bound"] < told[0]["bound"] - 0.05


def test_the_discount_is_that_in_use_unless_another_is_given(example: Service) -> None:
    example.set_policy("whittle", discount=0.5)

    used, given = bound(example.client).json(), bound(example.client, discount=0).json()

    assert used["discount"] == 0.5
    assert given["bound"] == pytest.approx(0.525, abs=1e-6)
    assert given["best_fixed"] == {"model": "item-3", "value": pytest.approx(0.525)}


def test_only_what_may_be_played_counts(service: Service) -> None:
    for name, like in (("good", [0.8, 0.9]), ("poor", [0.1, 0.3]), ("idle", [1, 1])):
        service.put_model(name, SIMPLE | {"like": like})
    service.put_item("a", "good")
    service.put_item("b", "poor")
    before = bound(service.client).json()
    service.put_item("c", "poor")
    service.client.delete("/v1/items/a").raise_for_status()

    after = bound(service.client).json()

    assert (before["models"], before["items"]) == (2, 2)
    assert before["best_fixed"]["model"] == "good"
    assert (after["models"], after["items"]) == (1, 2)
    assert after["best_fixed"]["model"] == "poor"
    assert after["bound"] < 0.3 / 0.05 < before["best_fixed"]["value"]


def test_an_empty_catalogue_has_no_bound(service: Service) -> None:
    refused = bound(service.client)

    assert refused.status_code == 409
    assert refused.json()["code"] == "nothing_to_play"


def test_what_would_take_too_long_is_refused(service: Service) -> None:
    signals = [f"s{number}" for number in range(32)]
    told = {"signals": signals, "observe": [[1 / 32] * 32] * 2, "reward": [1] * 32}
    model = {name: part for name, part in SIMPLE.items() if name != "like"} | told
    for number in range(18):
        service.put_model(f"m{number}", model)
        service.put_item(f"i{number}", f"m{number}")

    refused = [
        bound(service.client, discount=discount, depth=depth).json()
        for discount, depth in ((0.9, 2), (0.999, 0))
    ]

    assert [each["code"] for each in refused] == ["too_large_to_bound"] * 2
    assert [each["errors"][0]["field"] for each in refused] == ["depth", "discount"]
    assert bound(service.client, discount=0.5, depth=0).is_success


@pytest.mark.parametrize(("field", "value"), [("depth", 3), ("discount", 0.9991)])
def test_a_query_that_makes_no_sense_is_refused(
    example: Service, field: str, value: float
) -> None:
    refused = bound(example.client, **{field: value})

    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == field
