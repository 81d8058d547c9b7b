"""Several processes that serve together, some of which die."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from pathlib import Path

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.app.indexes import metric
from tests.app.postgres import Server, die_with_parent
from tests.app.service import ADMIN, Service, client_of
from tests.app.workers import Serving, serving
from tests.catalogues import load, paper_example

ROOT = Path(__file__).parents[2]
COUNT_ONE = """
from app import metrics

metrics.feedback("like", "reported").inc()
metrics.WORKERS.set(1)
print(metrics.NUMBER, flush=True)
input()
"""
GROWING = re.compile(r"_(total|count|bucket)$")


class Counting:
    """A process that has counted one like, and waits."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", COUNT_ONE],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=die_with_parent,  # noqa: PLW1509 - no threads run in the child
        )
        assert self._process.stdout is not None
        self.number = int(self._process.stdout.readline())

    def kill(self) -> None:
        self._process.kill()
        self._process.communicate()


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    directory = tmp_path / "shared"
    directory.mkdir()
    monkeypatch.setenv("PROMETHEUS_MULTIPROC_DIR", str(directory))
    return directory


def test_a_successor_counts_on_where_the_dead_stopped(
    service: Service, shared: Path
) -> None:
    def counted() -> tuple[float, float]:
        return (
            metric(service.client, "encore_feedback_total"),
            metric(service.client, "encore_workers"),
        )

    processes = [Counting() for _ in range(3)]
    files = {path.name for path in shared.iterdir()}
    assert [process.number for process in processes] == [0, 1, 2]
    assert counted() == (3, 3)

    for round_ in range(1, 4):
        processes[1].kill()
        assert counted() == (2 + round_, 2)
        processes[1] = Counting()
        assert processes[1].number == 1
        assert counted() == (3 + round_, 3)

    for process in processes:
        process.kill()
    assert counted() == (6, 0)
    assert {path.name for path in shared.iterdir()} == files


def test_a_file_that_was_only_begun_is_left_out(service: Service, shared: Path) -> None:
    process = Counting()
    (shared / "counter_7.db").touch()

    assert metric(service.client, "encore_feedback_total") == 1
    process.kill()


@pytest.fixture(scope="module")
def pair(postgres: Server) -> Iterator[Serving]:
    """Two workers with the paper's example 2."""
    postgres.execute("CREATE DATABASE pair TEMPLATE template_encore")
    with serving(postgres.url("pair"), workers=2) as running:
        load(running.client, paper_example(2))
        yield running
    postgres.execute("DROP DATABASE pair WITH (FORCE)")


def test_what_was_counted_never_falls_while_workers_die(pair: Serving) -> None:
    settle(pair)
    files = {path.name for path in pair.shared().iterdir()}
    scrapes = [growing(pair.client)]
    for round_ in range(3):
        victim = pair.workers()[round_ % 2]
        ask(pair, [f"{round_}-{number}" for number in range(32)])
        os.kill(victim, signal.SIGKILL)
        until(lambda dead=victim: dead not in pair.workers())  # type: ignore[misc]
        scrapes += [growing(pair.client) for _ in range(5)]
        settle(pair)
        scrapes.append(growing(pair.client))

    for before, after in pairwise(scrapes):
        assert {name for name, value in before.items() if after[name] < value} == set()
    assert {path.name for path in pair.shared().iterdir()} == files
    assert metric(pair.client, "encore_workers_ready") == 2


def test_a_pair_tells_how_it_is(pair: Serving) -> None:
    settle(pair)
    ask(pair, [f"user-{number}" for number in range(32)])

    found = {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(pair.client.get("/metrics").text)
        for sample in family.samples
    }

    assert found["encore_workers",] == 2
    assert found["encore_queue_limit",] == 2 * 4096
    assert found["encore_connection_limit", "read"] == 2 * 8
    assert found["encore_connections_in_use", "write"] <= 2 * 4
    assert found["encore_memory_bytes",] > 2 * 50_000_000
    assert 0 < found["encore_open_files_share",] < 1
    assert found["encore_commit_units_sum",] >= found["encore_commit_units_count",] > 0
    assert found["encore_loop_lag_seconds_count",] > 0
    assert found["encore_start_time_seconds",] == pytest.approx(time.time(), abs=600)


def test_a_worker_that_dies_while_the_database_is_away_comes_back_with_it(
    pair: Serving, postgres: Server
) -> None:
    settle(pair)
    postgres.execute("ALTER DATABASE pair ALLOW_CONNECTIONS false")
    postgres.execute(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = 'pair'"
    )
    victim = pair.workers()[0]
    os.kill(victim, signal.SIGKILL)
    until(lambda: victim not in pair.workers() and len(pair.workers()) == 2)

    until(lambda: metric(pair.client, "encore_workers") == 2)
    answers = [one(pair, "away").status_code for _ in range(16)]
    postgres.execute("ALTER DATABASE pair ALLOW_CONNECTIONS true")

    assert set(answers) == {503}
    settle(pair)
    ask(pair, [f"back-{number}" for number in range(32)])


def settle(pair: Serving) -> None:
    """Wait until both workers are there, and tell so."""
    until(
        lambda: (
            len(pair.workers()) == 2
            and metric(pair.client, "encore_workers_ready") == 2
        )
    )


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + 120
    while time.monotonic() < end:
        try:
            if true():
                return
        except (httpx.TransportError, FileNotFoundError, IndexError):
            pass  # a worker that died a moment ago
        time.sleep(0.05)
    raise TimeoutError


def growing(client: httpx.Client) -> dict[tuple[str, str], float]:
    """What may only grow."""
    return {
        (sample.name, str(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(scraped(client))
        for sample in family.samples
        if GROWING.search(sample.name)
    }


def scraped(client: httpx.Client) -> str:
    """What is read by who asks again if the worker that was asked has died."""
    for _ in range(10):
        try:
            return client.get("/metrics").raise_for_status().text
        except httpx.TransportError:
            continue
    raise TimeoutError


def ask(pair: Serving, users: list[str]) -> None:
    """A play for each user, each over a connection of its own."""
    with ThreadPoolExecutor(8) as threads:
        for answer in threads.map(partial(one, pair), users):
            answer.raise_for_status()


def one(pair: Serving, user: str) -> httpx.Response:
    with client_of(str(pair.client.base_url), ADMIN) as client:
        return client.get(f"/v1/users/{user}/next")
