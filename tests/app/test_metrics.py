"""What Prometheus reads, from one process and from several."""

import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from app.services import pending
from app.settings import Settings
from tests.app.postgres import Server
from tests.app.service import Service

ROOT = Path(__file__).parents[2]
Samples = dict[tuple[str, frozenset[tuple[str, str]]], float]


def scrape(service: Service) -> Samples:
    answer = httpx.get(f"{service.url}/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def grown(before: Samples, after: Samples, name: str, **labels: str) -> float:
    key = (name, frozenset(labels.items()))
    return after.get(key, 0.0) - before.get(key, 0.0)


def test_requests_decisions_answers_and_surprise_are_counted(
    example: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pending, "FRESH", 0.0)
    before = scrape(example)
    for signal in ("like", "skip", "none"):
        example.answer(example.next("ann")["play"], signal)
    example.next("ann")
    example.next("ben", count=3)

    after = scrape(example)

    route = "/v1/users/{user}/next"
    count = "encore_request_seconds_count"
    assert grown(before, after, count, method="GET", route=route, status="200") == 5
    assert grown(before, after, "encore_decision_seconds_count", policy="myopic") == 5
    for signal in ("like", "skip", "none"):
        taken = {"signal": signal, "source": "recommended"}
        assert grown(before, after, "encore_feedback_total", **taken) == 1
    assert grown(before, after, "encore_surprise_nats_count", policy="myopic") == 2
    assert grown(before, after, "encore_surprise_nats_sum", policy="myopic") > 0
    assert after["encore_pending_plays", frozenset()] == 4


def test_surprise_goes_to_the_policy_that_chose_the_play(example: Service) -> None:
    before = scrape(example)
    play = example.next("ann")["play"]
    example.set_policy("random")

    example.answer(play, "like")

    after = scrape(example)
    assert grown(before, after, "encore_surprise_nats_count", policy="myopic") == 1
    assert grown(before, after, "encore_surprise_nats_count", policy="random") == 0


def test_clients_cannot_make_new_labels(service: Service) -> None:
    before = scrape(service)
    for number in range(20):
        service.client.request(f"BREW{number}", "/v1/items")
        service.client.get(f"/nowhere/{number}")
        service.client.get(f"/static/{number}")
        service.client.get(f"/v1/users/{number}/beliefs")

    new = {labels for name, labels in scrape(service).keys() - before.keys()}

    routes = {dict(labels).get("route") for labels in new}
    methods = {dict(labels).get("method") for labels in new}
    assert routes <= {
        None,
        "unmatched",
        "/static",
        "/metrics",
        "/v1/items",
        "/v1/users/{user}/beliefs",
    }
    assert methods <= {None, "other", "GET"}


def test_a_scrape_works_without_the_database(
    postgres: Server, postgres_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pending, "FRESH", 0.0)
    settings = Settings(database_url=postgres_url, port=0, log_level="error")
    service = Service.start(settings)
    name = postgres_url.rpartition("/")[2]
    try:
        scrape(service)
        postgres.execute(f"ALTER DATABASE {name} ALLOW_CONNECTIONS false")
        postgres.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"  # noqa: S608
            f" WHERE datname = '{name}'"
        )

        after = scrape(service)

        assert ("encore_pending_plays", frozenset()) in after
        assert httpx.get(f"{service.url}/health/ready").status_code == 503
    finally:
        service.stop()


COUNT_ONE = """
from app import metrics

metrics.feedback("like", "reported").inc()
metrics.PENDING.set(7)
"""


def test_several_processes_are_counted_together(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    directory = tmp_path / "metrics"
    directory.mkdir()
    monkeypatch.setenv("PROMETHEUS_MULTIPROC_DIR", str(directory))
    for _ in range(3):
        subprocess.run([sys.executable, "-c", COUNT_ONE], cwd=ROOT, check=True)

    counted = scrape(service)

    labels = frozenset({("signal", "like"), ("source", "reported")})
    assert counted["encore_feedback_total", labels] == 3
    assert counted["encore_pending_plays", frozenset()] == 7
