"""Index tables: rough at once, full soon after, and the same in every replay."""

import asyncio
import json
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest

from app.settings import Settings
from app.storage import index_tables
from app.storage.database import Database
from app.storage.index_packing import pack, unpack
from app.storage.packing import UnknownFormat
from app.storage.store import Store
from tests.app.commands import Encore
from tests.app.indexes import building, present_policy, report, until
from tests.app.replays import taken_again
from tests.app.service import Service
from tests.catalogues import SIMPLE, load, paper_example

T = TypeVar("T")
ODD: dict[str, Any] = {  # as resting is paid more, playing becomes best again
    "states": ["low", "mid", "high"],
    "play": [[0.95, 0.03, 0.02], [0.19, 0.05, 0.76], [0.29, 0.71, 0.0]],
    "rest": [[0.11, 0.89, 0.0], [0.97, 0.03, 0.0], [0.0, 0.04, 0.96]],
    "like": [0.08, 0.11, 0.98],
    "prior": [0.41, 0.02, 0.57],
}


def large(states: int) -> dict[str, Any]:
    even = [1 / states] * states
    return {
        "states": [f"s{number}" for number in range(states)],
        "play": [even] * states,
        "rest": [even] * states,
        "like": [number / states for number in range(states)],
        "prior": even,
    }


def scores(service: Service, play: str) -> list[float]:
    record = service.client.get(f"/v1/plays/{play}", params={"explain": True}).json()
    return [group["score"] for group in record["explanation"]["candidates"]]


def test_a_model_that_is_published_gets_a_table_that_stays(service: Service) -> None:
    service.set_policy("myopic")
    service.put_model("even", SIMPLE)
    service.put_model("odd", ODD)
    waiting = report(service.client, "even")
    assert (waiting["state"], waiting["discount"]) == ("waiting", 0.95)
    assert (waiting["precision"], waiting["indexable"]) == (None, None)

    with building(service.settings) as builder:
        even = until(builder.client, "even", "ready")
        odd = until(builder.client, "odd", "ready")

    assert report(service.client, "even") == even
    assert (even["version"], even["precision"], even["progress"]) == (1, "full", 1.0)
    assert even["indexable"] is True
    assert even["unsettled"] == 0 < even["reached"]
    assert even["low"] < even["high"]
    assert even["error"] < 1e-3
    assert odd["indexable"] is False
    assert odd["unsettled"] > 0
    assert report(service.client, "even", discount=0.5)["state"] == "none"


def test_a_table_policy_works_at_once_gets_better_and_is_replayed(
    service: Service,
) -> None:
    load(service.client, paper_example(2))
    swapped = service.set_policy("whittle")
    assert swapped["tables"] == {"ready": 0, "rough": 5, "of": 5}
    rough = [service.next(user)["play"] for user in ("ann", "ben")]
    before = [scores(service, play) for play in rough]

    with building(service.settings) as builder:
        for item in paper_example(2):
            until(builder.client, item["id"], "ready")

        full = service.next("cat")["play"]

    assert present_policy(service.client) == swapped | {
        "tables": {"ready": 5, "rough": 0, "of": 5}
    }
    after = scores(service, full)
    assert [scores(service, play) for play in rough] == before
    assert np.abs(np.subtract(after, before[0])).max() > 0
    assert np.allclose(after, before[0], atol=0.1)
    fresh = Service.start(service.settings)
    try:
        assert [scores(fresh, play) for play in (*rough, full)] == [*before, after]
    finally:
        fresh.stop()
    again = [item for _, (item, *_) in taken_again(service, [*rough, full])]
    asked = [service.client.get(f"/v1/plays/{play}").json() for play in (*rough, full)]
    assert again == [play["item"] for play in asked]


def test_a_model_put_under_a_table_policy_can_be_played_at_once(
    service: Service,
    tmp_path: Path,
    encore: Encore,
) -> None:
    service.set_policy("whittle", discount=0.9)

    service.put_model("even", SIMPLE)
    service.put_item("a", "even")
    first = service.next("ann", explain=True)
    service.put_model("even", SIMPLE | {"like": [0.4, 0.8]})
    second = service.next("ben", explain=True)
    (tmp_path / "models.json").write_text(str([{"id": "odd", **ODD}]).replace("'", '"'))
    url = service.settings.database_url.replace("+asyncpg", "")
    said = encore("import", "models", tmp_path / "models.json", "--database-url", url)
    assert said.status == 0, said.err
    service.put_item("b", "odd")
    third = service.next("cat", explain=True)

    shown = [play["explanation"]["candidates"] for play in (first, second, third)]
    assert shown[0][0]["score"] < shown[1][0]["score"]
    assert len(shown[2]) == 2
    assert report(service.client, "odd")["precision"] == "rough"
    told = present_policy(service.client)
    assert told["tables"] == {"ready": 0, "rough": 2, "of": 2}
    [warning] = told["warnings"]
    assert warning.startswith("Not indexable at discount 0.9: 'odd'.")


def test_models_and_policies_that_change_at_once_leave_no_gap(
    service: Service,
) -> None:
    def put_models() -> None:
        for number in range(15):
            service.put_model(f"even-{number}", SIMPLE)

    def swap() -> None:
        for number in range(6):
            service.set_policy("myopic")
            service.set_policy("whittle", discount=0.5 + 0.01 * number)
            for _ in range(3):
                told = present_policy(service.client)["tables"]
                assert told["rough"] == told["of"]

    with ThreadPoolExecutor() as threads:
        for done in [threads.submit(put_models), threads.submit(swap)]:
            done.result()

    tables = {"ready": 0, "rough": 15, "of": 15}
    assert present_policy(service.client)["tables"] == tables
    service.put_item("a", "even-7")
    assert service.next("ann")["policy"]["name"] == "whittle"


def test_a_service_that_starts_sees_to_tables_that_are_missing(
    example: Service,
) -> None:
    def drop_all(store: Store) -> None:
        for key in index_tables.keys(store):
            index_tables.delete(store, key)

    example.set_policy("whittle")
    in_database(example, drop_all)

    again = Service.start(example.settings)
    try:
        play = again.next("ann")
    finally:
        again.stop()

    assert play["policy"]["name"] == "whittle"


def test_a_model_of_too_many_states_has_no_table(service: Service) -> None:
    service.set_policy("myopic")
    service.put_model("large", large(22))
    before = present_policy(service.client)

    whittle = service.client.put("/v1/admin/policy", json={"name": "whittle"})
    assert (whittle.status_code, whittle.json()["code"]) == (409, "too_many_states")
    assert whittle.json()["errors"][0]["value"] == "large"
    assert present_policy(service.client) == before
    assert report(service.client, "large")["state"] == "none"
    service.client.delete("/v1/models/large").raise_for_status()
    service.set_policy("whittle")
    put = service.client.put("/v1/models/large", json=large(22))
    assert (put.status_code, put.json()["code"]) == (409, "too_many_states")
    service.put_model("large", large(21))


@pytest.fixture
def begun_large(
    settings: Settings, tmp_path: Path, encore: Encore
) -> Iterator[Service]:
    """A service that began with a model too large for tables."""
    models = [{"id": "large", **large(22)}, {"id": "even", **SIMPLE}]
    (tmp_path / "models.json").write_text(json.dumps(models))
    url = settings.database_url.replace("+asyncpg", "")
    said = encore("import", "models", tmp_path / "models.json", "--database-url", url)
    assert said.status == 0, said.err
    running = Service.start(settings)
    yield running
    running.stop()


def test_a_service_that_begins_with_a_model_too_large_for_tables_needs_none(
    begun_large: Service,
) -> None:
    begun_large.put_item("a", "even")
    begun_large.put_item("b", "large")

    slate = begun_large.next("ann", count=2)["plays"]

    assert {play["item"] for play in slate} == {"a", "b"}
    policy = present_policy(begun_large.client)
    assert (policy["name"], policy["tables"]) == ("exact_rollout", None)
    assert policy["params"]["base"] == "myopic"


def test_tables_of_earlier_versions_are_kept_where_replays_need_them(
    service: Service,
) -> None:
    service.set_policy("whittle")
    service.put_model("even", SIMPLE)

    assert versions_kept_of(service, "even") == {1, 2}


def test_tables_of_earlier_versions_that_no_policy_used_are_dropped(
    begun_large: Service,
) -> None:
    begun_large.client.delete("/v1/models/large").raise_for_status()

    assert versions_kept_of(begun_large, "even") == {2}


def versions_kept_of(service: Service, model: str) -> set[int]:
    """Build the table of a model's first version and of its second; tell what stays."""
    with building(service.settings) as builder:
        until(builder.client, model, "ready")
        builder.put_model(model, SIMPLE | {"like": [0.3, 0.8]})
        assert until(builder.client, model, "ready")["version"] == 2
    return {key.version for key in in_database(service, index_tables.keys)}


def test_numbers_are_packed_to_the_bit() -> None:
    random = np.random.default_rng(0)
    index, value = random.normal(size=7), random.normal(size=(3, 5))

    packed = pack(index, value)

    again = unpack(packed)
    assert again[0].tobytes() == index.tobytes()
    assert again[1].tobytes() == value.tobytes()
    assert again[1].shape == value.shape
    for broken in (b"", packed[:20], packed[:-1], b"\x02" + packed[1:], packed[:16]):
        with pytest.raises(UnknownFormat):
            unpack(broken)


def in_database(service: Service, work: Callable[[Store], T]) -> T:
    async def run() -> T:
        database = Database(service.settings)
        try:
            return await database.run(work)
        finally:
            await database.close()

    return asyncio.run(run())
