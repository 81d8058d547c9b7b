"""The command `encore bench`, against services that keep their word, and others."""

import json
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager

import pytest
import uvicorn
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.load import bench
from app.main import create_app
from app.settings import Settings
from tests.app.commands import Encore, Said
from tests.app.service import ADMIN, Service, settings_of
from tests.catalogues import load, paper_example

Break = Callable[[ASGIApp, Scope, Receive, Send], Awaitable[None]]


def asked(encore: Encore, url: str, *words: object, key: str = ADMIN) -> Said:
    return encore("bench", "--url", url, "--key", key, *words, "--json")


def test_every_answer_is_checked_and_read_back(
    example: Service, encore: Encore
) -> None:
    sizes = "--users", 30, "--concurrency", 4, "--rate", 150, "--duration", 2
    said = asked(encore, example.url, *sizes, "--repeats", 0.2)
    assert said.status == 0, said.err
    told = said.json
    steps = {step: times["count"] for step, times in told["latency_ms"].items()}
    assert sum(steps.values()) == told["answered"] == told["checks"]["answers"]
    assert told["answered"] == pytest.approx(300, abs=1)
    assert told["checks"]["histories"] == steps["feedback"] > 0
    assert steps["next again"] > 0
    assert steps["feedback again"] > 0
    assert (told["failed"], told["checks"]["faults"]) == (0, {})
    assert {*told["histograms"]} == {*steps}
    database = "--database-url", example.settings.database_url
    assert encore("export", "history", *database).out == ""


def test_users_who_are_there_already_go_on_and_are_kept(
    example: Service, encore: Encore
) -> None:
    for number in range(4):
        example.answer(example.next(f"known-{number}")["play"], "like")
    sizes = "--users", 4, "--concurrency", 4, "--rate", 40, "--duration", 1
    said = asked(encore, example.url, *sizes, "--prefix", "known-")
    assert (said.status, said.json["checks"]["faults"]) == (0, {})
    held = example.client.get("/v1/users/known-0/plays").json()["plays"]
    assert len(held) > 1


def test_without_a_rate_a_share_of_the_maximum_is_asked_by_several_processes(
    example: Service, encore: Encore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "STEP", 0.3)
    sizes = "--users", 20, "--concurrency", 4, "--processes", 2, "--duration", 1
    said = asked(encore, example.url, *sizes, "--load", 0.5)
    assert said.status == 0, said.err
    told = said.json
    first, *others = told["steps"]
    assert first["rate"] is None
    assert others[0]["rate"] == first["answered"]
    assert told["rate"]["wanted"] == pytest.approx(0.5 * others[-1]["rate"])


@pytest.mark.parametrize(
    ("words", "status", "reason"),
    [
        (["--url", "nowhere"], 2, "no address"),
        (["--users", 3, "--concurrency", 4], 2, "cannot ask 4 at a time"),
        (["--concurrency", 2, "--processes", 3], 2, "cannot share 2 connections"),
        (["--key", "another"], 1, "cannot be tried"),
        (["--url", "http://127.0.0.1:9"], 1, "does not answer"),
    ],
)
def test_what_cannot_be_tried_is_told_before_anything_is_asked(
    words: list[object], status: int, reason: str, sqlite: Service, encore: Encore
) -> None:
    said = encore("bench", "--url", sqlite.url, "--key", ADMIN, *words)
    assert said.status == status
    assert reason in said.err


async def forget(_app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
    """Acknowledge an answer, and keep nothing of it."""
    play = scope["path"].split("/")[3]
    signal = json.loads(await _body(receive))["signal"]
    told = {"play": play, "signal": signal, "slot": 1, "repeated": False}
    await _say(send, 200, told)


async def change(app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
    """Take another answer than was sent."""
    sent = json.loads(await _body(receive))["signal"]
    await _with_body(app, scope, send, {"signal": {"like": "skip"}.get(sent, "like")})


async def double(app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
    """Take an answer twice, and say so."""
    body = json.loads(await _body(receive))
    await _with_body(app, scope, _nowhere, body)
    await _with_body(app, scope, send, body)


async def hush(app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
    """Take an answer, and say that it could not be taken."""
    await app(scope, receive, _nowhere)
    await _say(send, 503, {"code": "database_unavailable"})


@pytest.mark.parametrize(
    ("broken", "code"),
    [
        (forget, "lost_answer"),
        (change, "changed_answer"),
        (double, "doubled_answer"),
    ],
)
def test_a_service_that_does_not_keep_its_word_is_told(
    broken: Break, code: str, sqlite_settings: Settings, encore: Encore
) -> None:
    with service_that(broken, sqlite_settings, nth=10) as url:
        sizes = "--users", 10, "--concurrency", 2, "--rate", 60, "--duration", 2
        said = asked(encore, url, *sizes)
    assert said.status == 1
    assert said.json["checks"]["faults"][code] > 0
    shown = [fault for fault in said.json["checks"]["shown"] if fault["code"] == code]
    assert shown[0]["user"].startswith("bench-")
    assert "did not keep its promises" in said.err


def test_an_answer_that_was_taken_without_a_word_is_sent_again_and_no_fault(
    sqlite_settings: Settings, encore: Encore
) -> None:
    with service_that(hush, sqlite_settings, nth=10) as url:
        sizes = "--users", 4, "--concurrency", 2, "--rate", 60, "--duration", 2
        said = asked(encore, url, *sizes)
    assert (said.status, said.json["checks"]["faults"]) == (0, {})
    (failure,) = (one for one in said.json["failures"] if one["step"] == "feedback")
    assert (failure["status"], failure["code"]) == (503, "database_unavailable")
    assert said.json["failed"] == failure["count"] > 0


def test_who_waits_behind_a_slow_answer_is_counted_from_when_they_were_due(
    sqlite_settings: Settings, encore: Encore
) -> None:
    """A tool that waits for answers would see one slow request in two hundred."""
    stalled = threading.Event()

    async def stall(app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
        if not stalled.is_set():
            stalled.set()
            time.sleep(1)  # noqa: ASYNC251 - the whole service stands still
        await app(scope, receive, send)

    with service_that(stall, sqlite_settings, nth=1) as url:
        sizes = "--users", 10, "--concurrency", 1, "--rate", 100, "--duration", 2
        said = asked(encore, url, *sizes, "--repeats", 0)
    assert said.status == 0, said.err
    assert said.json["answered"] == pytest.approx(200, abs=1)
    for step in ("next", "feedback"):
        assert said.json["latency_ms"][step]["p90"] > 500
        assert said.json["queued_ms"]["p90"] > 500


@pytest.fixture
def sqlite_settings(sqlite_url: str) -> Settings:
    return settings_of(sqlite_url)


@pytest.fixture
def sqlite(sqlite_settings: Settings) -> Iterator[Service]:
    running = Service.start(sqlite_settings)
    load(running.client, paper_example(2))
    yield running
    running.stop()


@contextmanager
def service_that(broken: Break, settings: Settings, *, nth: int) -> Iterator[str]:
    """A real service, before which every nth answer is treated like that."""
    whole = Service.start(settings)
    load(whole.client, paper_example(2))
    whole.set_policy("myopic")
    whole.stop()
    app, count = create_app(settings), 0

    async def faulty(scope: Scope, receive: Receive, send: Send) -> None:
        nonlocal count
        if scope["type"] == "http" and scope["path"].endswith("/feedback"):
            count += 1
            if count % nth == 0:
                await broken(app, scope, receive, send)
                return
        await app(scope, receive, send)

    config = uvicorn.Config(faulty, port=0, log_config=None, access_log=False)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        assert thread.is_alive()
        time.sleep(0.005)
    yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    server.should_exit = True
    thread.join()


async def _body(receive: Receive) -> bytes:
    body, more = b"", True
    while more:
        message = await receive()
        body += message["body"]
        more = message.get("more_body", False)
    return body


async def _with_body(app: ASGIApp, scope: Scope, send: Send, body: object) -> None:
    """Hand a request on that holds this."""
    sent = json.dumps(body).encode()
    length = (b"content-length", str(len(sent)).encode())
    headers = [pair for pair in scope["headers"] if pair[0] != b"content-length"]

    async def receive() -> Message:
        return {"type": "http.request", "body": sent}

    await app({**scope, "headers": [*headers, length]}, receive, send)


async def _say(send: Send, status: int, told: object) -> None:
    body = json.dumps(told).encode()
    length = (b"content-length", str(len(body)).encode())
    start = {"type": "http.response.start", "status": status, "headers": [length]}
    await send(start)
    await send({"type": "http.response.body", "body": body})


async def _nowhere(_message: Message) -> None:
    pass
