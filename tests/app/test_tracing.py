"""Traces, as a collector is sent them."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.settings import Settings
from app.tracing import Parent, parent_of
from tests.app.collector import Collector, Kept, collecting
from tests.app.commands import Encore
from tests.app.postgres import free_port
from tests.app.service import ADMIN, Service
from tests.app.workers import serving
from tests.catalogues import load, paper_example

ROOT = Path(__file__).parents[2]
TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
SPAN = "00f067aa0ba902b7"
NEXT = "GET /v1/users/{user}/next"
FEEDBACK = "POST /v1/plays/{play}/feedback"
SERVER = 2
QUIET: Any = {"port": 0, "log_level": "error", "guard": "off", "bootstrap_key": ADMIN}


def traceparent(flags: str) -> dict[str, str]:
    return {"traceparent": f"00-{TRACE}-{SPAN}-{flags}"}


@pytest.fixture
def collector(monkeypatch: pytest.MonkeyPatch) -> Iterator[Collector]:
    with collecting() as running:
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", running.url)
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_COMPRESSION", "gzip")
        monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
        yield running


def named(spans: list[Kept], name: str) -> list[Kept]:
    return [span for span in spans if span.name == name]


def below(spans: list[Kept], parent: Kept) -> list[Kept]:
    return [span for span in spans if span.parent == parent.id]


@pytest.fixture
def always(
    collector: Collector, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Collector, Service]]:
    """A service that traces every request."""
    monkeypatch.setenv("OTEL_TRACES_SAMPLER", "always_on")
    service = Service.start(settings)
    load(service.client, paper_example(2))
    yield collector, service
    service.stop()


def test_a_trace_tells_what_a_request_did(always: tuple[Collector, Service]) -> None:
    collector, service = always
    play = service.next("ann-the-listener")["play"]
    service.answer(play, "like", next=True)

    spans = collector.until(lambda spans: bool(named(spans, FEEDBACK)))

    system = "sqlite" if service.settings.on_sqlite else "postgresql"
    for name, unit in ((NEXT, "unit next_play"), (FEEDBACK, "unit give_feedback")):
        [request] = named(spans, name)
        method, _, route = name.partition(" ")
        assert (request.kind, request.parent, request.failed) == (SERVER, "", False)
        assert request.attributes["http.request.method"] == method
        assert request.attributes["http.route"] == route
        assert request.attributes["http.response.status_code"] == 200
        assert {span.trace for span in below(spans, request)} == {request.trace}
        [work] = named(below(spans, request), unit)
        [commit] = named(below(spans, request), "commit")
        [decision] = named(below(spans, work), "decision")
        reads = named(below(spans, work), "read")
        assert reads
        assert {read.attributes["db.system.name"] for read in reads} == {system}
        assert any("users" in str(r.attributes["db.query.text"]) for r in reads)
        assert decision.attributes["encore.policy"] == "exact_rollout"
        order = [request.began, work.began, reads[0].began, reads[0].ended]
        order += [decision.began, decision.ended, work.ended]
        order += [commit.began, commit.ended, request.ended]
        assert order == sorted(order)
        assert abs(request.ended / 1e9 - time.time()) < 600
    assert collector.resources[0]["service.name"] == "encore"
    assert not any(b"ann-the-listener" in body for body in collector.bodies)


def test_a_failed_request_is_marked(always: tuple[Collector, Service]) -> None:
    collector, service = always
    service.client.get("/v1/plays/not-a-play")

    spans = collector.until(lambda spans: bool(named(spans, "GET /v1/plays/{play}")))

    [request] = named(spans, "GET /v1/plays/{play}")
    assert request.attributes["http.response.status_code"] == 422
    assert not request.failed  # the caller is at fault


def test_a_callers_trace_is_continued_and_named_in_the_log(
    sqlite_url: str, collector: Collector, capfd: pytest.CaptureFixture[str]
) -> None:
    extra = {"OTEL_TRACES_SAMPLER": "always_on", "ENCORE_LOG_LEVEL": "info"}
    extra |= {"OTEL_SERVICE_NAME": "songs", "OTEL_RESOURCE_ATTRIBUTES": "team=night"}
    with serving(sqlite_url, extra=extra) as running:
        running.client.get("/v1/items", headers=traceparent("00"))
        spans = collector.until(lambda spans: bool(named(spans, "GET /v1/items")))

    [request] = named(spans, "GET /v1/items")
    lines = map(json.loads, capfd.readouterr().out.splitlines())
    [line] = [line for line in lines if line.get("route") == "/v1/items"]
    assert (request.trace, request.parent) == (TRACE, SPAN)
    assert line["trace_id"] == TRACE
    assert line["request_id"] == request.attributes["encore.request_id"]
    assert collector.resources[0]["service.name"] == "songs"
    assert collector.resources[0]["team"] == "night"


@pytest.mark.parametrize(
    ("sampler", "trust", "flags", "traced"),
    [
        ("parentbased_always_off", "false", "01", 0),
        ("always_on", "false", "00", 20),
        ("always_off", "true", "01", 20),
        ("parentbased_always_on", "true", "00", 0),
    ],
)
@pytest.mark.usefixtures("trusting")
def test_callers_decide_what_is_traced_only_where_they_are_trusted(
    sqlite_url: str, collector: Collector, flags: str, traced: int
) -> None:
    service = Service.start(Settings(database_url=sqlite_url, **QUIET))
    for _ in range(20):
        service.client.get("/v1/items", headers=traceparent(flags))
    service.stop()

    assert len(named(collector.spans, "GET /v1/items")) == traced


@pytest.fixture
def trusting(monkeypatch: pytest.MonkeyPatch, sampler: str, trust: str) -> None:
    monkeypatch.setenv("OTEL_TRACES_SAMPLER", sampler)
    monkeypatch.setenv("ENCORE_TRUST_TRACEPARENT", trust)


def test_few_requests_are_traced_if_nothing_is_said_of_how_many(
    sqlite_url: str, collector: Collector
) -> None:
    service = Service.start(Settings(database_url=sqlite_url, **QUIET))
    for _ in range(400):
        service.client.get("/health/live", headers=traceparent("01"))
    service.stop()

    assert len(collector.spans) <= 40


def test_a_collector_that_is_away_is_not_missed(
    sqlite_url: str, capfd: pytest.CaptureFixture[str]
) -> None:
    extra = {
        "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT": f"http://127.0.0.1:{free_port()}/v1/traces",
        "OTEL_TRACES_SAMPLER": "always_on",
        "OTEL_BSP_SCHEDULE_DELAY": "10",
        "ENCORE_LOG_LEVEL": "warning",
    }
    with serving(sqlite_url, extra=extra) as running:
        for _ in range(50):
            assert running.client.get("/v1/items").status_code == 200
    assert running.process.returncode == 0
    lines = [json.loads(line) for line in capfd.readouterr().out.splitlines()]
    assert any("127.0.0.1" in line["event"] for line in lines), lines


def test_nothing_of_it_is_loaded_where_nothing_is_traced() -> None:
    code = """
import sys
from app.main import create_app
app = create_app()
assert not [name for name in sys.modules if name.startswith("opentelemetry.sdk")]
assert "Traced" not in {layer.cls.__name__ for layer in app.user_middleware}
"""
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_missing_packages_are_named(sqlite_url: str) -> None:
    code = """
import sys
sys.modules["opentelemetry.sdk"] = None
from app.cli import main
sys.argv = ["encore", "serve", "--port", "0"]
main()
"""
    surroundings = {
        "ENCORE_DATABASE_URL": sqlite_url,
        "OTEL_TRACES_EXPORTER": "otlp",
        "PATH": "",
    }
    ended = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
        check=False,
    )

    assert ended.returncode == 2, ended.stderr
    assert "comes with the extra `otel`" in ended.stderr


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("OTEL_TRACES_SAMPLER", "jaeger_remote"),
        ("OTEL_TRACES_SAMPLER_ARG", "2"),
        ("OTEL_TRACES_EXPORTER", "zipkin"),
        ("OTEL_EXPORTER_OTLP_PROTOCOL", "grpc"),
        ("OTEL_EXPORTER_OTLP_ENDPOINT", "collector:4317"),
    ],
)
def test_what_cannot_be_followed_is_refused(
    encore: Encore, monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)

    said = encore("serve", "--port", 0)

    assert said.status == 2
    assert name in said.err


def test_a_traceparent_is_read_as_the_standard_says() -> None:
    parent = Parent(int(TRACE, 16), int(SPAN, 16), sampled=True)

    assert parent_of(f"00-{TRACE}-{SPAN}-01") == parent
    assert parent_of(f"00-{TRACE}-{SPAN}-03") == parent
    assert parent_of(f"42-{TRACE}-{SPAN}-01-more-to-come") == parent
    for wrong in (
        f"ff-{TRACE}-{SPAN}-01",
        f"00-{TRACE}-{SPAN}-01-more",
        f"00-{TRACE.upper()}-{SPAN}-01",
        f"00-{'0' * 32}-{SPAN}-01",
        f"00-{TRACE}-{'0' * 16}-01",
        f"00-{TRACE}-{SPAN}",
        f" 00-{TRACE}-{SPAN}-01",
    ):
        assert parent_of(wrong) is None


def test_a_traceparent_sent_twice_says_nothing(
    sqlite_url: str, collector: Collector, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OTEL_TRACES_SAMPLER", "always_on")
    service = Service.start(Settings(database_url=sqlite_url, **QUIET))
    header = traceparent("01")["traceparent"]
    twice = [("traceparent", header), ("traceparent", header)]
    httpx.get(f"{service.url}/health/live", headers=twice)
    service.stop()

    [request] = named(collector.spans, "GET /health/live")
    assert request.parent == ""
