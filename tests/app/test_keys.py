"""Keys: made, shown once, checked, revoked; secrets stay secret."""

import asyncio
import sqlite3
import threading
import time
from functools import partial

import asyncpg

from app.domain import Scope
from app.services.keys import ensure, in_force
from app.settings import Settings
from app.storage.database import Database
from app.storage.tables import metadata
from tests.app.service import ADMIN, Service

KEYS = "/v1/admin/keys"


def make(service: Service, scope: str, name: str = "a client") -> dict[str, str]:
    answer = service.client.post(KEYS, json={"scope": scope, "name": name})
    assert answer.status_code == 201, answer.text
    made: dict[str, str] = answer.json()
    return made


def test_a_key_serves_until_it_is_revoked(service: Service) -> None:
    key = make(service, "serve", "web player")

    listed = service.client.get(KEYS)
    with service.with_key(key["key"]) as client:
        served = client.get("/v1/users/ann/next")
        revoked = service.client.delete(f"{KEYS}/{key['id']}")
        refused = client.get("/v1/users/ann/next")

    assert {k["name"]: k["scope"] for k in listed.json()["keys"]} == {
        "bootstrap": "admin",
        "web player": "serve",
    }
    shown = {"id", "scope", "name", "created_at", "expires_at", "origins"}
    assert set(listed.json()["keys"][0]) == shown
    assert served.json()["code"] == "nothing_to_play"
    assert revoked.status_code == 204
    assert refused.status_code == 401
    assert refused.headers["www-authenticate"] == "Bearer"
    assert service.client.delete(f"{KEYS}/{key['id']}").status_code == 404


def test_a_revoked_key_is_soon_refused_by_another_worker_too(
    service: Service,
) -> None:
    key = make(service, "serve")
    other = Service.start(service.settings)
    try:
        with other.with_key(key["key"]) as client:
            assert client.get("/v1/items").status_code == 200
            service.client.delete(f"{KEYS}/{key['id']}")
            deadline = time.monotonic() + 30  # far more than it takes
            while client.get("/v1/items").status_code != 401:
                assert time.monotonic() < deadline
    finally:
        other.stop()


def test_only_admin_keys_administer(service: Service) -> None:
    key = make(service, "serve")

    with service.with_key(key["key"]) as client:
        answers = [
            client.get(KEYS),
            client.post(KEYS, json={"scope": "admin", "name": "more"}),
            client.delete(f"{KEYS}/{key['id']}"),
            client.get("/v1/admin/policy"),
            client.put("/v1/admin/policy", json={"name": "random"}),
            client.put("/v1/admin/policy", json={"name": "no such"}),
            client.post("/v1/admin/policy/rollback"),
        ]

    assert {answer.status_code for answer in answers} == {403}
    assert {answer.json()["code"] for answer in answers} == {"forbidden"}


def test_every_call_that_its_document_protects_is_protected(service: Service) -> None:
    document = service.client.get("/openapi.json").json()
    service.client.headers.pop("Authorization")

    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            answer = service.client.request(method, path.replace("{play}", "x"))
            open_to_all = path in {"/metrics", "/health/live", "/health/ready"}
            assert ("security" in operation) is not open_to_all
            assert (answer.status_code == 401) is not open_to_all, (method, path)


def test_the_last_admin_key_stays_even_if_two_revoke_each_other(
    service: Service,
) -> None:
    mine = service.client.get(KEYS).json()["keys"][0]["id"]
    last = service.client.delete(f"{KEYS}/{mine}")
    other = make(service, "admin")
    statuses: list[int] = []

    def revoke(secret: str, key: str) -> None:
        with service.with_key(secret) as client:
            statuses.append(client.delete(f"{KEYS}/{key}").status_code)

    threads = [
        threading.Thread(target=revoke, args=(ADMIN, other["id"])),
        threading.Thread(target=revoke, args=(other["key"], mine)),
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert last.status_code == 409
    assert last.json()["code"] == "last_admin_key"
    assert statuses.count(204) == 1, statuses
    with service.with_key(other["key"]) as client:
        assert {client.get(KEYS).status_code, service.client.get(KEYS).status_code} == {
            200,
            401,
        }


def test_a_wrong_form_makes_no_key(service: Service) -> None:
    wrong: list[dict[str, object]] = [
        {},
        {"scope": "root", "name": "x"},
        {"scope": "serve"},
        {"scope": "serve", "name": ""},
        {"scope": "serve", "name": "\x00"},
        {"scope": "serve", "name": 1},
        {"scope": "serve", "name": "x" * 201},
        {"scope": "serve", "name": "x", "key": "chosen"},
    ]

    for form in wrong:
        assert service.client.post(KEYS, json=form).status_code == 422, form

    assert len(service.client.get(KEYS).json()["keys"]) == 1


def test_secrets_are_neither_kept_nor_shown_again(service: Service) -> None:
    made = make(service, "admin")
    secrets = (ADMIN, made["key"])

    shown = ""
    for secret in secrets:
        with service.with_key(secret) as client:
            shown += client.get(KEYS).text
            shown += client.delete(f"{KEYS}/{made['key']}").text
            shown += client.put("/v1/admin/policy", json={"name": made["key"]}).text
            shown += client.get("/metrics").text

    kept = everything_kept(service.settings.database_url)
    for secret in secrets:
        assert secret not in shown
        assert secret not in kept


def test_workers_that_start_together_make_one_key(database_url: str) -> None:
    async def start() -> int:
        databases = [Database(Settings(database_url=database_url)) for _ in range(8)]
        made = partial(ensure, secret=ADMIN, scope=Scope.ADMIN, name="bootstrap")
        await asyncio.gather(*(database.run(made) for database in databases))
        present = await databases[0].run(in_force)
        for database in databases:
            await database.close()
        return len(present)

    assert asyncio.run(start()) == 1


def everything_kept(url: str) -> str:
    if not url.startswith("sqlite"):
        return asyncio.run(everything_on_postgresql(url.replace("+asyncpg", "")))
    connection = sqlite3.connect(url.removeprefix("sqlite:///"))
    kept = "\n".join(connection.iterdump())
    connection.close()
    return kept


async def everything_on_postgresql(url: str) -> str:
    connection = await asyncpg.connect(url)
    rows = [
        str(row)
        for table in metadata.tables
        for row in await connection.fetch(f'SELECT * FROM "{table}"')  # noqa: S608
    ]
    await connection.close()
    return "\n".join(rows)
