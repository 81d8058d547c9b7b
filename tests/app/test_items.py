"""Items over HTTP: put, seen, listed, retired."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import Any
from urllib.parse import quote

import pytest

from app.storage import items, revision
from app.storage.database import Database
from tests.app.service import Service

MODEL = {
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.4, 0.6]],
    "rest": [[0.7, 0.3], [0.1, 0.9]],
    "like": [0.2, 0.9],
    "prior": [0.5, 0.5],
}

WRONG_ITEMS: list[tuple[dict[str, Any], str]] = [
    ({}, "model"),
    ({"model": 7}, "model"),
    ({"model": "jazz"}, "model"),
    ({"model": ""}, "model"),
    ({"model": "pop", "colour": "red"}, "colour"),
    ({"model": "pop", "title": "a\nb"}, "title"),
    ({"model": "pop", "title": "a\x00b"}, "title"),
    ({"model": "pop", "title": "x" * 501}, "title"),
    ({"model": "pop", "title": None}, "title"),
    ({"model": "pop", "tags": "calm"}, "tags"),
    ({"model": "pop", "tags": ["calm", "calm"]}, "tags"),
    ({"model": "pop", "tags": ["calm", "no space"]}, "tags.1"),
    ({"model": "pop", "tags": ["x" * 129]}, "tags.0"),
    ({"model": "pop", "tags": [str(n) for n in range(65)]}, "tags"),
    ({"model": "pop", "payload": []}, "payload"),
    ({"model": "pop", "payload": {"x": "y" * 17_000}}, "payload"),
    ({"model": "pop", "payload": {"x": "\x00"}}, "payload"),
    ({"model": "pop", "payload": {"\x00": 1}}, "payload"),
]
UNKEEPABLE = [
    '{"x": NaN}',
    '{"x": -Infinity}',
    '{"x": 1e400}',
    '{"x": "\\ud800"}',
    '{"\\ud800": 1}',
    '{"x": ' + "[" * 40 + "]" * 40 + "}",
    '{"x": ' + "[" * 400_000,
    '{"x": ' + "9" * 5000 + "}",
]
WRONG_PAGES = [
    "limit=0",
    "limit=1001",
    "limit=x",
    "retired=perhaps",
    "cursor=",
    "cursor=%00",
    "cursor=Mg",
    "cursor=IlwwIg",
    "cursor=Ilx1MDAwMCI",
    "cursor=Ilx1ZDgwMCI",
    "cursor=W1tbW1tb",
]
INVISIBLE = ["a b", "%20", "%00", "%ff", "x" * 129, "%ed%a0%80"]


@pytest.fixture
def catalogue(service: Service) -> Service:
    service.put_model("pop", MODEL)
    return service


def put(service: Service, item: str, **form: Any) -> tuple[int, dict[str, Any]]:  # noqa: ANN401
    answer = service.client.put(f"/v1/items/{quote(item, safe='')}", json=form)
    told: dict[str, Any] = answer.json()
    return answer.status_code, told


def catalogue_number(service: Service) -> int:
    async def read() -> int:
        database = Database(service.settings)
        try:
            return (await database.run(revision.current)).catalogue
        finally:
            await database.close()

    return asyncio.run(read())


def serials(service: Service) -> dict[str, int]:
    async def read() -> dict[str, int]:
        database = Database(service.settings)
        try:
            found = await database.run(items.in_order)
        finally:
            await database.close()
        return {item.id: item.serial for item in found}

    return asyncio.run(read())


def test_an_item_is_kept_as_it_was_put(catalogue: Service) -> None:
    form = {
        "model": "pop",
        "title": "Nachtfahrt 👨‍👩‍👧",
        "tags": ["calm", "late"],
        "payload": {"url": "x", "deep": [{"a": None}, 1.5, True, "é"], "big": 10**30},
    }

    status, put_ = put(catalogue, "song-7", **form)
    got = catalogue.client.get("/v1/items/song-7").json()

    assert status == 201
    assert put_ == got
    assert {key: got[key] for key in form} == form
    assert (got["id"], got["active"]) == ("song-7", True)
    assert got["created_at"] == got["updated_at"]
    play = catalogue.next("ann")
    assert (play["title"], play["payload"]) == (form["title"], form["payload"])


def test_the_same_item_again_changes_nothing(catalogue: Service) -> None:
    form = {"model": "pop", "title": "x", "payload": {"n": 1, "m": [2]}}
    put(catalogue, "a", **form)
    before = catalogue_number(catalogue)

    status, _ = put(catalogue, "a", **form | {"payload": {"m": [2], "n": 1}})
    assert (status, catalogue_number(catalogue)) == (200, before)

    _, told = put(catalogue, "a", **form | {"payload": {"n": True, "m": [2]}})
    assert told["payload"]["n"] is True
    assert told["updated_at"] > told["created_at"]
    assert catalogue_number(catalogue) == before + 1


def test_a_retired_item_is_recommended_no_more_until_it_returns(
    catalogue: Service,
) -> None:
    put(catalogue, "a", model="pop")

    assert catalogue.client.delete("/v1/items/a").status_code == 204
    assert catalogue.client.delete("/v1/items/a").status_code == 204
    assert catalogue.client.get("/v1/users/ann/next").status_code == 409
    assert catalogue.client.get("/v1/items/a").json()["active"] is False
    assert put(catalogue, "a", model="pop")[1]["active"] is True
    assert catalogue.next("ann")["item"] == "a"


def test_items_are_listed_page_by_page(catalogue: Service) -> None:
    names = ["a", "b/c?", "d%2F", "日本", "..e", "\ue000\U000e0fff"]
    for name in names:
        put(catalogue, name, model="pop")
    catalogue.client.delete("/v1/items/d%252F")

    listed: list[str] = []
    cursor: str | None = None
    while cursor is not None or not listed:
        query = {"limit": 2} | ({"cursor": cursor} if cursor else {})
        page = catalogue.client.get("/v1/items", params=query).json()
        assert len(page["items"]) <= 2
        listed += [item["id"] for item in page["items"]]
        cursor = page["next"]

    everything = catalogue.client.get("/v1/items", params={"retired": True}).json()
    assert sorted(listed) == sorted(set(names) - {"d%2F"})
    assert sorted(item["id"] for item in everything["items"]) == sorted(names)


@pytest.mark.parametrize(
    ("search", "found"),
    [
        ("night", ["a", "b-night"]),
        ("NIGHT D", ["a"]),
        ("50%", ["c"]),
        ("5%", []),
        ("_", ["under_score"]),
        ("/", ["sl/ash"]),
        ("'; --", []),
        ("日本", ["日本"]),
        ("", ["a", "b-night", "c", "sl/ash", "under_score", "日本"]),
    ],
)
def test_items_are_found_by_id_or_title(
    catalogue: Service, search: str, found: list[str]
) -> None:
    titles = {"a": "Night Drive", "c": "50% off", "gone": "Night"}
    for name in ("a", "b-night", "c", "gone", "sl/ash", "under_score", "日本"):
        put(catalogue, name, model="pop", title=titles.get(name, "Song"))
    catalogue.client.delete("/v1/items/gone")

    page = catalogue.client.get("/v1/items", params={"search": search}).json()

    assert sorted(item["id"] for item in page["items"]) == found


def test_new_items_put_at_once_all_land_with_serials_of_their_own(
    catalogue: Service,
) -> None:
    names = [f"item-{number}" for number in range(48)]

    with ThreadPoolExecutor(16) as threads:
        answers = list(threads.map(lambda n: put(catalogue, n, model="pop"), names))

    assert [status for status, _ in answers] == [201] * 48
    assert set(serials(catalogue)) == set(names)
    assert sorted(serials(catalogue).values()) == list(range(48))


def test_a_wrong_item_is_refused_with_the_field_named(
    catalogue: Service,
) -> None:
    for form, field in WRONG_ITEMS:
        status, told = put(catalogue, "a", **form)

        code = "unknown_model" if form.get("model") == "jazz" else "invalid_request"
        assert (status, told["code"]) == (422, code), form
        assert [fault["field"] for fault in told["errors"]] == [field]
    assert catalogue.client.get("/v1/items/a").status_code == 404


def test_json_that_cannot_be_kept_is_refused(catalogue: Service) -> None:
    for payload in UNKEEPABLE:
        answer = catalogue.client.put(
            "/v1/items/a",
            content=f'{{"model": "pop", "payload": {payload}}}'.encode(),
            headers={"Content-Type": "application/json"},
        )

        assert answer.status_code == 422, answer.text
        assert answer.headers["Content-Type"] == "application/problem+json"


def test_a_wrong_page_is_refused(catalogue: Service) -> None:
    for query in WRONG_PAGES:
        answer = catalogue.client.get(f"/v1/items?{query}")

        assert answer.status_code == 422, query
        assert answer.json()["errors"][0]["field"] == query.partition("=")[0]


def test_no_item_has_a_name_that_is_not_visible(catalogue: Service) -> None:
    for method, name in product(("PUT", "GET", "DELETE"), INVISIBLE):
        body = {"model": "pop"} if method == "PUT" else None
        answer = catalogue.client.request(method, f"/v1/items/{name}", json=body)
        assert answer.status_code == 422, (method, name)
        assert answer.json()["errors"][0]["field"] == "item"


def test_an_unknown_item_is_not_found(catalogue: Service) -> None:
    for method in ("GET", "DELETE"):
        answer = catalogue.client.request(method, "/v1/items/a")
        assert (answer.status_code, answer.json()["code"]) == (404, "item_not_found")


def test_only_an_admin_key_changes_the_catalogue(catalogue: Service) -> None:
    form = {"scope": "serve", "name": "app"}
    key = catalogue.client.post("/v1/admin/keys", json=form).json()["key"]

    with catalogue.with_key(key) as client:
        statuses = [
            client.get("/v1/items").status_code,
            client.put("/v1/items/a", json={"model": "pop"}).status_code,
            client.delete("/v1/items/a").status_code,
            client.get("/v1/models/pop").status_code,
            client.put("/v1/models/pop", json=MODEL).status_code,
            client.delete("/v1/models/pop").status_code,
        ]

    assert statuses == [200, 403, 403, 200, 403, 403]
