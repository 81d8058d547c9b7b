"""A listener of the paper's example 2, against an independent filter, for 200 plays."""

import random

import httpx
import pytest

from app.settings import Settings
from app.storage import migrate
from tests.app.workers import served
from tests.catalogues import Models, load, paper_example
from tests.filter import Filter

PLAYS = 200


class Listener:
    """Somebody whose answers follow the paper's chances."""

    def __init__(self, user: str, models: Models) -> None:
        self.user = user
        self.filter = Filter(models)
        self.random = random.Random(user)  # noqa: S311 - a seeded listener

    def listen(self, client: httpx.Client, plays: int) -> None:
        for _ in range(plays):
            play = client.get(f"/v1/users/{self.user}/next").json()
            assert play["like"] == pytest.approx(
                self.filter.like(play["item"]), abs=1e-9
            )
            signal = self._answer(play["like"])
            client.post(
                f"/v1/plays/{play['play']}/feedback", json={"signal": signal}
            ).raise_for_status()
            self.filter.take(play["item"], signal)

    def compare(self, client: httpx.Client) -> None:
        """What the service believes of every item is what the filter computes."""
        names = list(self.filter.beliefs)
        held = client.get(
            f"/v1/users/{self.user}/beliefs", params={"item": names}
        ).json()
        assert [belief["item"] for belief in held["beliefs"]] == names
        for belief in held["beliefs"]:
            expected = self.filter.beliefs[belief["item"]]
            assert belief["belief"] == pytest.approx(expected, abs=1e-9)
            assert belief["like"] == pytest.approx(
                self.filter.like(belief["item"]), abs=1e-9
            )

    def _answer(self, like: float) -> str:
        if self.random.random() < 0.1:
            return "none"
        return "like" if self.random.random() < like else "skip"


@pytest.mark.parametrize("policy", ["myopic", "rollout", "random"])
def test_beliefs_are_those_of_an_independent_filter_across_a_restart(
    sqlite_url: str, policy: str
) -> None:
    listen_across_a_restart(sqlite_url, policy, workers=1)


def test_the_same_holds_on_postgresql_with_four_workers(postgres_url: str) -> None:
    listen_across_a_restart(postgres_url, "random", workers=4)


def listen_across_a_restart(database_url: str, policy: str, *, workers: int) -> None:
    paper = paper_example(2)
    migrate.upgrade(Settings(database_url=database_url).database_url)
    listeners = [Listener(f"listener-{number}", paper) for number in range(2)]
    for part in range(2):
        with served(database_url, workers=workers) as client:
            if part == 0:
                load(client, paper)
                client.put("/v1/admin/policy", json={"name": policy}).raise_for_status()
            for listener in listeners:
                listener.listen(client, PLAYS // 2)
                listener.compare(client)
