"""Several processes on one PostgreSQL: each obeys a change at once."""

import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest

from tests.app.indexes import metric, until
from tests.app.postgres import Server
from tests.app.service import ADMIN, client_of
from tests.app.workers import served
from tests.catalogues import SIMPLE, load, paper_example

WORKERS = 4
THREADS = 16


@pytest.fixture(scope="module")
def crowd(postgres: Server) -> Iterator[httpx.Client]:
    """Four workers with the paper's example 2."""
    postgres.execute("CREATE DATABASE crowd TEMPLATE template_encore")
    with served(
        postgres.url("crowd"), workers=WORKERS, extra={"ENCORE_INDEX_TABLES": "auto"}
    ) as client:
        load(client, paper_example(2))
        yield client
    postgres.execute("DROP DATABASE crowd WITH (FORCE)")


def test_every_worker_obeys_a_swap_on_its_next_request(crowd: httpx.Client) -> None:
    for round_, policy in enumerate(("myopic", "random", "best_fixed", "myopic")):
        swapped = crowd.put("/v1/admin/policy", json={"name": policy}).json()
        expected = {"version": swapped["version"], "name": policy}

        plays = in_parallel(crowd, [f"user-{round_}-{number}" for number in range(64)])

        assert [play["policy"] for play in plays] == [expected] * 64


def test_every_worker_obeys_an_experiment_on_its_next_request(
    crowd: httpx.Client,
) -> None:
    present = crowd.get("/v1/admin/policy").json()["version"]
    for round_ in range(3):
        arms = [
            {"name": "one", "share": 0.5, "policy": {"name": "best_fixed"}},
            {"name": "two", "share": 0.5, "policy": {"name": "random"}},
        ]
        form = {"name": f"round-{round_}", "arms": arms}
        begun = crowd.put("/v1/admin/experiment", json=form).raise_for_status().json()
        own = {arm["policy"]["version"] for arm in begun["arms"]}

        during = in_parallel(crowd, [f"in-{round_}-{number}" for number in range(64)])
        crowd.delete("/v1/admin/experiment").raise_for_status()
        after = in_parallel(crowd, [f"out-{round_}-{number}" for number in range(64)])

        assert {version_of(play) for play in during} == own
        assert {version_of(play) for play in after} == {present}


def version_of(play: dict[str, Any]) -> int:
    version: int = play["policy"]["version"]
    return version


def test_every_worker_knows_a_new_item_at_once(crowd: httpx.Client) -> None:
    in_parallel(crowd, [f"early-{number}" for number in range(32)])
    crowd.put("/v1/items/brand-new", json={"model": "item-1"}).raise_for_status()

    plays = in_parallel(
        crowd, [f"user-{n}" for n in range(64)], {"candidate": "brand-new"}
    )

    assert {play["item"] for play in plays} == {"brand-new"}


def test_every_worker_obeys_a_clock_on_its_next_request(crowd: httpx.Client) -> None:
    users = [f"late-{number}" for number in range(32)]
    for play in in_parallel(crowd, users):
        told = crowd.post(f"/v1/plays/{play['play']}/feedback", json={"signal": "like"})
        told.raise_for_status()
    crowd.put("/v1/admin/clock", json={"slot_s": 1}).raise_for_status()
    time.sleep(2.1)

    following = [play["slot"] for play in in_parallel(crowd, users)]
    crowd.delete("/v1/admin/clock").raise_for_status()

    assert min(map(int, map(str, following))) >= 3


def test_one_of_many_answers_wins_across_workers(crowd: httpx.Client) -> None:
    for round_ in range(10):
        [play] = in_parallel(crowd, [f"ann-{round_}"])

        def answer(signal: str, play: str = str(play["play"])) -> httpx.Response:
            with client_of(str(crowd.base_url), ADMIN) as client:
                return client.post(
                    f"/v1/plays/{play}/feedback", json={"signal": signal}
                )

        with ThreadPoolExecutor(THREADS) as threads:
            answers = list(threads.map(answer, ["like", "skip"] * (THREADS // 2)))

        found = Counter(answer.status_code for answer in answers)
        assert found == {200: THREADS // 2, 409: THREADS // 2}
        assert crowd.get(f"/v1/users/ann-{round_}/beliefs").json()["slot"] == 1


def test_workers_share_the_tables_and_build_each_once(crowd: httpx.Client) -> None:
    def put(number: int) -> None:
        with client_of(str(crowd.base_url), ADMIN) as client:
            model = client.put(f"/v1/models/even-{number}", json=SIMPLE)
            model.raise_for_status()

    with ThreadPoolExecutor(THREADS) as threads:
        list(threads.map(put, range(8)))

    models = [model["id"] for model in crowd.get("/v1/models").json()["models"]]
    for model in models:
        until(crowd, model, "ready")
    assert metric(crowd, "encore_index_build_seconds_count") == len(models)


def test_sqlite_is_served_by_one_worker(
    sqlite_url: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with served(sqlite_url, workers=3) as client:
        load(client, paper_example(2))

    said = capfd.readouterr()
    assert "serving with 1 process, not 3" in said.err


def in_parallel(
    crowd: httpx.Client, users: list[str], params: dict[str, str] | None = None
) -> list[dict[str, Any]]:
    """A play for each user, each over a connection of its own."""

    def ask(user: str) -> dict[str, Any]:
        with client_of(str(crowd.base_url), ADMIN) as client:
            answer = client.get(f"/v1/users/{user}/next", params=params)
        play: dict[str, Any] = answer.raise_for_status().json()
        return play

    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(ask, users))
