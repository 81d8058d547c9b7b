"""What an attacker would try: see docs/security.md."""

import gzip
import json
import re
import secrets
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx
import pytest

from app.services.rates import MOST_KEPT, Rate
from app.settings import Settings
from tests.app.commands import Encore
from tests.app.service import ADMIN, Service
from tests.app.test_audits import audit
from tests.app.workers import served
from tests.catalogues import SIMPLE

KEYS = "/v1/admin/keys"
PAGE = "https://player.example.com"
INJECTIONS = (
    "'; DROP TABLE plays; --",
    '" OR "1"="1',
    "1) UNION SELECT digest FROM keys --",
    "%'; SELECT pg_sleep(60); --",
    "\\'; DELETE FROM users; --",
    ":model",
    "%(id)s {0} $1 ?",
)


def made(service: Service, **fields: object) -> dict[str, Any]:
    form = {"scope": "serve", "name": "player", **fields}
    answer = service.client.post(KEYS, json=form)
    assert answer.status_code == 201, answer.text
    told: dict[str, Any] = answer.json()
    return told


@pytest.fixture
def playing(service: Service) -> Service:
    """A service with a few items and a user."""
    service.put_model("pop", SIMPLE)
    for item in ("a", "b", "c"):
        service.put_item(item, "pop", tags=["calm"])
    service.set_policy("myopic")
    service.answer(service.next("ann")["play"], "like")
    return service


def test_a_rotated_key_gives_way_without_a_gap(service: Service) -> None:
    old = made(service, origins=[PAGE])

    new = service.client.post(f"{KEYS}/{old['id']}/rotate", json={"grace_s": 3}).json()

    assert (new["scope"], new["name"]) == ("serve", "player")
    assert new["origins"] == [PAGE]
    assert new["key"] != old["key"]
    with service.with_key(old["key"]) as before, service.with_key(new["key"]) as after:
        assert after.get("/v1/items").status_code == 200
        statuses = [before.get("/v1/items").status_code]
        while statuses[-1] == 200:
            statuses.append(before.get("/v1/items").status_code)
        assert set(statuses) == {200, 401}
        assert after.get("/v1/items").status_code == 200
    listed = {key["id"]: key for key in service.client.get(KEYS).json()["keys"]}
    assert old["id"] not in listed
    assert listed[new["id"]]["expires_at"] is None
    again = service.client.post(f"{KEYS}/{old['id']}/rotate")
    assert (again.status_code, again.json()["code"]) == (404, "key_not_found")
    wrong = service.client.post(f"{KEYS}/{new['id']}/rotate", json={"grace_s": -1})
    assert wrong.json()["errors"][0]["field"] == "grace_s"


def test_the_only_admin_key_can_be_rotated_and_then_ends(service: Service) -> None:
    [first] = service.client.get(KEYS).json()["keys"]

    new = service.client.post(f"{KEYS}/{first['id']}/rotate").json()

    with service.with_key(new["key"]) as client:
        last = client.delete(f"{KEYS}/{new['id']}")
        assert (last.status_code, last.json()["code"]) == (409, "last_admin_key")
        assert client.delete(f"{KEYS}/{first['id']}").status_code == 204
        assert client.get(KEYS).status_code == 200
    assert service.client.get(KEYS).status_code == 401


def test_keys_are_rotated_and_bound_to_origins_from_the_command_line(
    encore: Encore, sqlite_url: str
) -> None:
    at = ("--database-url", sqlite_url)
    encore("keys", "create", "--origin", PAGE, *at)
    [key] = encore("keys", "list", "--json", *at).json

    rotated = encore("keys", "rotate", key["id"], "--grace", 60, "--json", *at).json

    both = {each["id"]: each for each in encore("keys", "list", "--json", *at).json}
    assert both[key["id"]]["expires_at"] > key["created_at"]
    assert both[rotated["id"]]["origins"] == PAGE
    assert rotated["key"].startswith("encore_")
    for words in (
        ("create", "--origin", "example.com"),
        ("create", "--scope", "admin", "--origin", PAGE),
        ("rotate", rotated["key"]),
    ):
        said = encore("keys", *words, *at)
        assert said.status == 2, said
        assert rotated["key"] not in said.err


@pytest.mark.parametrize(
    "origins",
    [
        ["*"],
        ["null"],
        ["example.com"],
        ["https://example.com/"],
        ["https://EXAMPLE.com"],
        ["https://a b"],
        ["https://example.com\r\nX: y"],
        [""],
        [PAGE] * 33,
        PAGE,
    ],
)
def test_what_is_no_origin_is_refused(service: Service, origins: object) -> None:
    form = {"scope": "serve", "name": "x", "origins": origins}

    refused = service.client.post(KEYS, json=form)

    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"].startswith("origins")
    admin = {"scope": "admin", "name": "x", "origins": [PAGE]}
    refused = service.client.post(KEYS, json=admin)
    assert refused.json()["errors"][0]["field"] == "origins"


def test_an_origin_is_kept_as_browsers_send_it(service: Service) -> None:
    given = [f"{PAGE}:443", "http://a.example:80", "https://b.example:80"]
    form = {"scope": "serve", "name": "x", "origins": given}

    kept = service.client.post(KEYS, json=form).json()["origins"]

    assert kept == [PAGE, "http://a.example", "https://b.example:80"]


def asked(client: httpx.Client, origin: str) -> httpx.Response:
    headers = {"Origin": origin, "Access-Control-Request-Method": "POST"}
    return client.options("/v1/users/ann/next", headers=headers)


def test_pages_of_other_origins_may_call_with_keys_that_are_for_them(
    playing: Service,
) -> None:
    leave = "access-control-allow-origin"
    plain, bound = made(playing), made(playing, origins=[PAGE])
    path, evil = "/v1/users/ann/next", "https://evil.example.com"

    with httpx.Client(base_url=playing.url) as nobody:
        first = asked(nobody, PAGE)
        assert (first.status_code, first.headers[leave]) == (204, PAGE)
        assert "authorization" in first.headers["access-control-allow-headers"].lower()
        assert first.headers["vary"] == "Origin"
        assert leave not in asked(nobody, evil).headers
        assert leave not in nobody.get(path, headers={"Origin": PAGE}).headers
    with playing.with_key(bound["key"]) as client:
        told = client.get(path, headers={"Origin": PAGE})
        assert (told.status_code, told.headers[leave]) == (200, PAGE)
        wrong = client.get(f"{path}?wrong=1", headers={"Origin": PAGE})
        assert (wrong.status_code, wrong.headers[leave]) == (422, PAGE)
        assert leave not in client.get(path).headers
        refused = client.get(path, headers={"Origin": evil})
        assert (refused.status_code, refused.json()["code"]) == (403, "unknown_origin")
        assert leave not in refused.headers
    with playing.with_key(plain["key"]) as client:
        told = client.get(path, headers={"Origin": PAGE})
        assert (told.status_code, leave in told.headers) == (200, False)
        assert told.headers["vary"] == "Origin"


@pytest.fixture
def limited(settings: Settings) -> Iterator[Service]:
    """A service that takes five requests of a key at once, and two about a user."""
    running = Service.start(
        settings.with_changes(
            key_rate=0.05, user_rate=0.02, rate_burst=timedelta(seconds=100)
        )
    )
    yield running
    running.stop()


def test_who_asks_too_often_is_told_when_to_come_again(limited: Service) -> None:
    key, other = made(limited), made(limited)

    with limited.with_key(key["key"]) as client:
        about = [client.get("/v1/users/ann/beliefs") for _ in range(3)]
        others = [client.get("/v1/users/bob/beliefs") for _ in range(2)]
        others.append(client.get("/v1/items"))  # what is refused counts for nobody
        refused = client.get("/v1/items")
    with limited.with_key(other["key"]) as client:
        assert client.get("/v1/items").status_code == 200

    assert [answer.status_code for answer in about] == [200, 200, 429]
    assert [answer.status_code for answer in others] == [200] * 3
    for answer, of, most in ((about[-1], "user", 50), (refused, "key", 20)):
        problem = answer.json()
        assert (answer.status_code, problem["code"]) == (429, "too_many_requests")
        assert [fault["field"] for fault in problem["errors"]] == [of]
        assert 0 < int(answer.headers["retry-after"]) <= most


def test_those_who_wait_are_not_gone_through_at_each_request() -> None:
    rate = Rate("user", 0.001, burst_s=1e6)
    for number in range(MOST_KEPT + 1):
        rate.take(f"user-{number}")
    kept = rate._due

    rate.take("another")

    assert rate._due is kept
    assert len(kept) == MOST_KEPT + 2


def test_without_a_key_nothing_is_told_of_who_exists(playing: Service) -> None:
    expired = made(playing)
    playing.client.post(f"{KEYS}/{expired['id']}/rotate", json={"grace_s": 0})
    play = playing.next("ann")["play"]
    unknown = "01890000-0000-7000-8000-000000000000"

    for kind in ("/v1/users/{}/export", "/v1/users/{}/beliefs", "/v1/plays/{}"):
        names = (play, unknown) if "plays" in kind else ("ann", "nobody")
        for secret in ("encore_" + "x" * 43, expired["key"], "\u00e9"):
            headers = [(b"authorization", f"Bearer {secret}".encode())]
            answers = [
                httpx.get(playing.url + kind.format(name), headers=headers)
                for name in names
            ]
            assert {answer.status_code for answer in answers} == {401}
            assert answers[0].content == answers[1].content


def bodies(form: object) -> Iterator[Any]:
    """A form with an injection in each of its texts, one at a time."""
    if isinstance(form, str):
        yield from INJECTIONS
    elif isinstance(form, dict):
        for name, value in form.items():
            for changed in bodies(value):
                yield {**form, name: changed}
            for injection in INJECTIONS:
                yield {**form, injection: value}
    elif isinstance(form, list):
        for place, value in enumerate(form):
            for changed in bodies(value):
                yield [*form[:place], changed, *form[place + 1 :]]


FORMS: dict[tuple[str, str], object] = {
    ("PUT", "/v1/models/pop"): {
        "states": ["low", "high"],
        "play": [[1, 0], [0, 1]],
        "rest": [[1, 0], [0, 1]],
        "prior": [1, 0],
        "signals": ["no", "yes"],
        "observe": [[1, 0], [0, 1]],
        "reward": [0, 1],
        "source": "me",
    },
    ("PUT", "/v1/items/x"): {"model": "pop", "title": "t", "tags": ["calm"]},
    ("POST", "/v1/users/bob/next"): {"tag": ["calm"], "candidate": ["a"]},
    ("POST", "/v1/users/bob/plays"): {"item": "a", "signal": "like"},
    ("PUT", "/v1/admin/policy"): {"name": "myopic", "params": {}, "note": "why"},
    ("POST", KEYS): {"scope": "serve", "name": "x", "origins": [PAGE]},
    ("POST", "/v1/admin/policy/rollback"): {"note": "why"},
}


def test_no_field_reaches_the_database_as_sql(playing: Service) -> None:
    document = playing.client.get("/openapi.json").json()
    before = playing.client.get("/v1/users/ann/plays").json()
    sent = 0

    for (method, path), form in FORMS.items():
        for body in bodies(form):
            answer = playing.client.request(method, path, json=body)
            assert answer.status_code < 500, (path, body, answer.text)
            sent += 1
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            names = [each["name"] for each in operation.get("parameters", ())]
            for injection in INJECTIONS:
                at = re.sub(r"\{\w+\}", quote(injection, safe=""), path)
                query = {name: injection for name in names if f"{{{name}}}" not in path}
                headers = {"Idempotency-Key": injection, "X-Request-ID": injection}
                if path == "/v1/users/{user}" and method == "delete":
                    continue  # it would be taken at its word
                for params in ({}, query):
                    answer = playing.client.request(
                        method, at, params=params, headers=headers
                    )
                    assert answer.status_code < 500, (method, at, params, answer.text)
                    sent += 1

    assert sent > 500
    assert playing.client.get("/v1/users/ann/plays").json() == before
    assert {tuple(found.findings) for found in audit(playing)} == {()}


@pytest.mark.parametrize(
    ("body", "headers"),
    [
        (b"[" * 500_000, {}),
        (b'{"a":' * 150_000, {}),
        (b'{"signal": ' + b"9" * 900_000 + b"}", {}),
        (b'{"fraction": 1e' + b"9" * 900_000 + b"}", {}),
        (b"{" + b",".join(b'"k%d": 1' % n for n in range(80_000)) + b"}", {}),
        (b'"' + b"\\u0000" * 160_000 + b'"', {}),
        (gzip.compress(b" " * 50_000_000), {"Content-Encoding": "gzip"}),
        (gzip.compress(b" " * 50_000_000), {}),
    ],
    ids=["deep", "deeper", "digits", "exponent", "keys", "escapes", "gzip", "bytes"],
)
def test_bombs_do_not_go_off(
    playing: Service, body: bytes, headers: dict[str, str]
) -> None:
    play = playing.next("ann")["play"]
    kind = {"Content-Type": "application/json", **headers}

    answer = playing.client.post(
        f"/v1/plays/{play}/feedback", content=body, headers=kind
    )

    assert 400 <= answer.status_code < 500, answer.text
    assert len(answer.content) < 50_000
    assert playing.answer(play, "skip")["signal"] == "skip"


@pytest.mark.parametrize("kind", ["sqlite_url", "postgres_url"])
def test_logs_hold_no_secret_and_no_line_of_a_client(
    kind: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    url: str = request.getfixturevalue(kind)
    log = tmp_path / "log"
    forged = '{"event": "forged"}'
    lines = f"\r\n{forged}\n\x1b[2J\u2028{forged}"
    hidden = [ADMIN, secrets.token_hex(16)]

    with served(url, extra={"ENCORE_LOG_LEVEL": "debug"}, log=log) as client:
        client.put("/v1/models/pop", json=SIMPLE).raise_for_status()
        made = client.post(KEYS, json={"scope": "serve", "name": lines}).json()
        rotated = client.post(f"{KEYS}/{made['id']}/rotate").json()
        hidden += [made["key"], rotated["key"]]
        client.get(f"/v1/users/{quote(lines, safe='')}/beliefs")
        client.get("/v1/users/ann/next", params={"tag": lines})
        client.get("/v1/items", headers={"X-Request-ID": forged})
        client.get("/v1/items", headers={"Authorization": f"Bearer {hidden[1]}"})
        client.get("/v1/items", headers={"Authorization": f"Basic {hidden[1]}"})
        client.delete(f"{KEYS}/{rotated['key']}")
        client.put("/v1/items/x", json={"model": lines, "title": hidden[1]})

    written = log.read_text()
    told = [json.loads(line) for line in written.splitlines() if line]
    assert len(told) > 10
    assert "forged" not in {line.get("event") for line in told}
    assert "\x1b" not in written
    for secret in (*hidden, url.partition("@")[0]):
        assert secret not in written or "sqlite" in secret
