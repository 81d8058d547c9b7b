"""A service that is told to stop finishes what it has begun, and nothing else."""

import signal
import threading
from dataclasses import dataclass, field

import httpx
import pytest

from app.settings import Settings
from tests.app.service import ADMIN, Service, client_of
from tests.app.workers import serving
from tests.catalogues import load, paper_example

LISTENERS = 12
PLAYS = 40  # that are answered before the service is told to stop


@dataclass
class Told:
    """What a listener was told, and what it asked for without an answer."""

    answered: list[str] = field(default_factory=list)
    unheard_users: list[str] = field(default_factory=list)
    unheard_plays: list[str] = field(default_factory=list)
    refused: list[int] = field(default_factory=list)


class Crowd:
    """Listeners who ask on, each as soon as it is answered, until nobody answers."""

    def __init__(self, url: str) -> None:
        self.told = [Told() for _ in range(LISTENERS)]
        self._url = url
        self._enough = threading.Semaphore(0)
        self._threads = [
            threading.Thread(target=self._listen, args=(number, told))
            for number, told in enumerate(self.told)
        ]
        for thread in self._threads:
            thread.start()

    def wait(self, plays: int) -> None:
        for _ in range(plays):
            assert self._enough.acquire(timeout=60)

    def end(self) -> None:
        for thread in self._threads:
            thread.join()

    def _listen(self, number: int, told: Told) -> None:
        with client_of(self._url, ADMIN) as client:
            for turn in range(100_000):
                try:
                    self._turn(client, f"user-{number}-{turn}", told)
                except httpx.ConnectError:
                    return

    def _turn(self, client: httpx.Client, user: str, told: Told) -> None:
        try:
            play = client.get(f"/v1/users/{user}/next")
        except (httpx.ReadError, httpx.RemoteProtocolError, httpx.WriteError):
            told.unheard_users.append(user)
            return
        if not play.is_success:
            told.refused.append(play.status_code)
            return
        name = play.json()["play"]
        try:
            taken = client.post(f"/v1/plays/{name}/feedback", json={"signal": "like"})
        except (httpx.ReadError, httpx.RemoteProtocolError, httpx.WriteError):
            told.unheard_plays.append(name)
            return
        if taken.is_success:
            told.answered.append(name)
            self._enough.release()
        else:
            told.refused.append(taken.status_code)


@pytest.mark.parametrize("workers", [1, 3])
def test_what_was_begun_is_answered_and_what_was_answered_is_kept(
    postgres_url: str, workers: int
) -> None:
    stop_under_load(postgres_url, workers)


def test_on_sqlite_too(sqlite_url: str) -> None:
    stop_under_load(sqlite_url, workers=1)


def stop_under_load(database_url: str, workers: int) -> None:
    with serving(database_url, workers=workers) as running:
        load(running.client, paper_example(2))
        crowd = Crowd(str(running.client.base_url))
        crowd.wait(PLAYS)
        running.process.send_signal(signal.SIGTERM)
        crowd.end()
        assert running.process.wait(60) == 0

    after = Service.start(
        Settings(
            database_url=database_url,
            port=0,
            bootstrap_key=ADMIN,
            guard="off",
            log_level="error",
        )
    )
    try:
        for told in crowd.told:
            assert told.refused == []
            for play in told.answered:
                found = after.client.get(f"/v1/plays/{play}").json()
                assert found["signal"] == "like"
            for play in told.unheard_plays:
                found = after.client.get(f"/v1/plays/{play}").json()
                assert found["signal"] is None
            for user in told.unheard_users:
                found = after.client.get(f"/v1/users/{user}/export")
                assert found.status_code == 404, found.text
    finally:
        after.stop()
