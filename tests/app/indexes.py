"""What tests ask of index tables."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import httpx
from prometheus_client.parser import text_string_to_metric_families

from app.settings import Settings
from tests.app.service import Service

Report = dict[str, Any]


@contextmanager
def building(settings: Settings) -> Iterator[Service]:
    """A service that builds tables in the background."""
    service = Service.start(settings.with_changes(index_tables="auto"))
    try:
        yield service
    finally:
        service.stop()


def report(client: httpx.Client, model: str, **query: float) -> Report:
    answer = client.get(f"/v1/models/{model}/index", params=query)
    assert answer.is_success, answer.text
    told: Report = answer.json()
    return told


def until(client: httpx.Client, model: str, state: str, **query: float) -> Report:
    """The report of a model once its full table is in this state."""
    end = time.monotonic() + 120
    while time.monotonic() < end:
        found = report(client, model, **query)
        if found["state"] == state:
            return found
        time.sleep(0.02)
    raise TimeoutError(f"the table of {model} was never {state}")


def present_policy(client: httpx.Client) -> Mapping[str, Any]:
    policy: Mapping[str, Any] = client.get("/v1/admin/policy").json()
    return policy


def metric(client: httpx.Client, name: str) -> float:
    """The sum of what a metric counts."""
    return sum(
        sample.value
        for family in text_string_to_metric_families(client.get("/metrics").text)
        for sample in family.samples
        if sample.name == name
    )
