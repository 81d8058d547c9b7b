"""Plain requests take a shorter way, and nobody can tell by the answers."""

import re
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.types import ASGIApp, Receive, Scope, Send

from app import main
from app.api.straight import Straight
from app.settings import Settings
from tests.app.postgres import free_port
from tests.app.service import ADMIN, Service
from tests.app.test_metrics import grown, scrape
from tests.catalogues import load, paper_example

PAGE = "https://player.example.com"
UUID = re.compile(r"[0-9a-f]{8}-[0-9a-f-]{27}")
NEXT, PLAY = "/v1/users/ann/next", "/v1/plays/{play}/feedback"
NOBODYS = "/v1/plays/00000000-0000-7000-8000-000000000000/feedback"
JSON = {"Content-Type": "application/json"}
LIKE = b'{"signal": "like"}'
FIRST = {"key": "serve"}  # what a case is, beside this


def get(path: str = NEXT, **told: object) -> Mapping[str, Any]:
    return {"method": "GET", "url": path, **told}


def post(body: bytes = LIKE, path: str = PLAY, **told: object) -> Mapping[str, Any]:
    return {"method": "POST", "url": path, "content": body, "headers": JSON, **told}


PLAIN = {
    "next": get(),
    "next for another spelling": get("/v1/users/%61nn%3A1/next"),
    "a slate": get("/v1/users/slated/next"),
    "feedback": post(),
    "feedback, then what is next": post(path=f"{PLAY}?next=true"),
    "a share played": post(b'{"fraction": 0.9}'),
    "none": post(b'{"signal": "none"}'),
    "utf-16": post('{"signal": "like"}'.encode("utf-16")),
    "with a charset": post(headers={"Content-Type": "application/json; charset=x"}),
    "no play of that name": post(path=NOBODYS),
    "a signal that the model has not": post(b'{"signal": "love"}'),
    "no key": get(key=""),
    "a wrong key": post(key="wrong"),
    "a scheme that is none": get(headers={"Authorization": "Basic YTpi"}),
    "a page of the key's origin": get(headers={"Origin": PAGE}, key="bound"),
    "a page of another origin": get(headers={"Origin": "https://a.b"}, key="bound"),
    "a form that is refused before it is read": post(b" " * 2_000_000 + LIKE),
    "a page, and a key that is not bound": post(headers=JSON | {"Origin": PAGE}),
}
UNUSUAL = {
    "filters": get(f"{NEXT}?exclude=interest-1&count=2"),
    "a query that is not known": get(f"{NEXT}?exlude=interest-1"),
    "an empty name": get("/v1/users//next"),
    "a name that is too long": get(f"/v1/users/{'a' * 999}/next"),
    "a name with NUL": get("/v1/users/%00/next"),
    "a name that is no text": get("/v1/users/%ff/next"),
    "another method": {**get(), "method": "PATCH"},
    "only the head": {**get(), "method": "HEAD"},
    "no id of a play": post(path="/v1/plays/first/feedback"),
    "not next": post(path=f"{PLAY}?next=maybe"),
    "nothing": post(b""),
    "no JSON": post(b"{"),
    "no text": post(b"\xff"),
    "no object": post(b"[]"),
    "both": post(b'{"signal": "like", "fraction": 1}'),
    "no number": post(b'{"fraction": NaN}'),
    "a field that is not known": post(b'{"signal": "like", "extra": 1}'),
    "half of a pair": post(b'{"signal": "\\ud800"}'),
    "a long number": post(b'{"fraction": ' + b"9" * 5000 + b"}"),
    "nested deeply": post(b"[" * 9000),
    "a long form": post(b" " * 20_000 + LIKE),
    "no form": post(headers={"Content-Type": "text/plain"}),
    "in parts": post(chunked=True),
}


class Counting(Straight):
    """Counts what it hands on."""

    handed_on = 0

    def __init__(self, app: ASGIApp) -> None:
        async def counted(scope: Scope, receive: Receive, send: Send) -> None:
            Counting.handed_on += 1
            await app(scope, receive, send)

        super().__init__(counted)


@pytest.fixture(scope="module")
def both(
    sqlite_template: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple["Pair", "Pair"]]:
    """A service with the short way, and one without."""
    services = []
    with pytest.MonkeyPatch.context() as patch:
        for way in (Counting, lambda app: app):
            patch.setattr(main, "Straight", way)
            path = tmp_path_factory.mktemp("straight") / "encore.db"
            path.write_bytes(sqlite_template.read_bytes())
            services.append(Service.start(settings_for(f"sqlite:///{path}")))
    pairs = Pair(services[0]), Pair(services[1])
    yield pairs
    for service in services:
        service.stop()


def settings_for(url: str, **more: object) -> Settings:
    told = {"database_url": url, "port": free_port(), "bootstrap_key": ADMIN}
    quiet = {"log_level": "error", "index_tables": "off", "guard": "off"}
    return Settings.model_validate(told | quiet | more)


class Pair:
    """A service, with keys and users who are the same in both."""

    def __init__(self, service: Service) -> None:
        self.service = service
        load(service.client, paper_example(2))
        service.set_policy("myopic")
        service.client.get("/v1/users/slated/next?count=2").raise_for_status()
        made = partial(_made, service)
        self.keys = {
            "serve": made(),
            "bound": made(origins=[PAGE]),
            "wrong": "nobody's",
        }

    def asked(self, case: Mapping[str, Any]) -> tuple[object, ...]:
        """All of an answer that does not come from chance or the clock."""
        told = FIRST | dict(case)
        key, chunked = self.keys.get(told.pop("key")), told.pop("chunked", False)
        headers = {"X-Request-ID": "the-same", **told.pop("headers", {})}
        if key is not None:
            headers.setdefault("Authorization", f"Bearer {key}")
        if "{play}" in told["url"]:
            play = self.service.next("ann")["play"]
            told["url"] = told["url"].replace("{play}", play)
        if chunked:
            told["content"] = iter([told["content"][:5], told["content"][5:]])
        answer = httpx.request(
            told.pop("method"),
            self.service.url + told.pop("url"),
            headers=headers,
            **told,
        )
        kept = {n: v for n, v in answer.headers.items() if n != "date"}
        return answer.status_code, kept, UUID.sub("an id", answer.text)


def _made(service: Service, **fields: object) -> str:
    form = {"scope": "serve", "name": "player", **fields}
    return str(service.client.post("/v1/admin/keys", json=form).json()["key"])


@pytest.mark.parametrize("case", [*PLAIN, *UNUSUAL])
def test_an_answer_is_the_same_on_both_ways(case: str, both: tuple[Pair, Pair]) -> None:
    short, long = both
    told = (PLAIN | UNUSUAL)[case]
    before = Counting.handed_on
    assert short.asked(told) == long.asked(told)
    assert (Counting.handed_on > before) == (case in UNUSUAL)


def test_requests_on_the_short_way_are_counted_by_their_routes(
    both: tuple[Pair, Pair],
) -> None:
    short, _ = both
    before = scrape(short.service)
    for number in range(3):
        play = short.service.next(f"counted-{number}")
        short.service.answer(play["play"], "like")
    after = scrape(short.service)

    for method, route in (
        ("GET", "/v1/users/{user}/next"),
        ("POST", "/v1/plays/{play}/feedback"),
    ):
        labels = {"method": method, "route": route, "status": "200"}
        assert grown(before, after, "encore_request_seconds_count", **labels) == 3


def test_requests_on_the_short_way_are_limited_by_key_and_user(
    sqlite_url: str,
) -> None:
    limits = {"user_rate": 1, "rate_burst": "PT2S"}
    service = Service.start(settings_for(sqlite_url, **limits))
    load(service.client, paper_example(2))
    answers = [service.client.get(NEXT).status_code for _ in range(4)]
    others = service.client.get("/v1/users/bob/next").status_code
    service.stop()
    assert (answers[0], answers[-1], others) == (200, 429, 200)
