"""Index tables built in the background: shared, taken over, never in the way."""

import signal
from datetime import timedelta
from pathlib import Path

import pytest

from app.domain import ItemModel
from app.errors import DatabaseUnavailable
from app.services import index_builder, index_builds, index_tables
from app.services.index_builds import Look
from app.services.index_tables import Built
from tests.app.commands import start
from tests.app.indexes import building, metric, report, until
from tests.app.postgres import free_port
from tests.app.service import ADMIN, Service, client_of
from tests.app.workers import wait_until_ready
from tests.catalogues import SIMPLE, paper_example

SLOW = 0.999  # a discount at which a full table of four states takes minutes


def four_states() -> dict[str, object]:
    """A model of the paper's example 2."""
    model = paper_example(2)[0]
    return {field: model[field] for field in model if field != "id"}


def test_progress_is_told_and_a_stop_leaves_the_work_to_others(
    service: Service,
) -> None:
    service.put_model("slow", four_states())
    service.set_policy("whittle", discount=SLOW)
    with building(service.settings) as builder:
        until(builder.client, "slow", "building")
        while report(service.client, "slow")["progress"] == 0:
            assert metric(builder.client, "encore_index_tables_waiting") == 1

        seen = report(service.client, "slow")

    assert 0 < seen["progress"] < 1
    assert seen["precision"] == "rough"
    assert report(service.client, "slow")["state"] == "waiting"


def test_what_a_killed_process_was_building_is_taken_over(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    service.put_model("slow", four_states())
    service.set_policy("whittle", discount=SLOW)
    port = free_port()
    url = service.settings.database_url.replace("+asyncpg", "")
    environment = {
        "ENCORE_DATABASE_URL": url,
        "ENCORE_BOOTSTRAP_KEY": ADMIN,
        "ENCORE_INDEX_TABLES": "auto",
    }
    process = start("serve", "--port", port, cwd=tmp_path, extra=environment)
    with client_of(f"http://127.0.0.1:{port}", ADMIN) as client:
        wait_until_ready(client, process)
        until(service.client, "slow", "building")
        process.send_signal(signal.SIGKILL)
        process.communicate()
    assert report(service.client, "slow")["state"] == "building"
    monkeypatch.setattr(index_builds, "LEASE", timedelta(seconds=0))
    assert report(service.client, "slow")["state"] == "waiting"
    monkeypatch.setattr(index_builds, "LEASE", timedelta(seconds=0.5))

    with building(service.settings) as builder:
        service.set_policy("whittle")
        assert until(builder.client, "slow", "ready")["discount"] == 0.95


def test_a_table_that_cannot_be_built_holds_up_no_other(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = index_tables.full

    def fail(model: ItemModel, *rest: object) -> Built:
        if model.id == "bad":
            raise MemoryError
        return build(model, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(index_tables, "full", fail)
    with building(service.settings) as builder:
        builder.put_model("bad", SIMPLE)
        builder.put_model("good", SIMPLE)
        until(builder.client, "good", "ready")

        monkeypatch.setattr(index_tables, "full", build)
        monkeypatch.setattr(index_builds, "LEASE", timedelta(seconds=0.5))
        builder.put_model("better", SIMPLE)

        until(builder.client, "bad", "ready")


def test_an_outage_delays_tables_and_no_more(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    claim = index_builds.claim
    outages = iter([DatabaseUnavailable("It is away."), ValueError("What is this?")])

    def fail_at_first(*args: object, **named: object) -> Look:
        for outage in outages:
            raise outage
        return claim(*args, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(index_builds, "claim", fail_at_first)
    monkeypatch.setattr(index_builder, "POLL", 0.01)
    with building(service.settings) as builder:
        builder.put_model("even", SIMPLE)

        until(builder.client, "even", "ready")

    assert next(outages, None) is None
