"""Shadows decide, too, and nobody notices: not those who are served, nor in time."""

import time
from collections.abc import Iterator
from typing import Any

import pytest

from app.services import shadow_watch
from app.settings import Settings
from tests.app.experimenting import MYOPIC, RANDOM, arm, begin, report
from tests.app.odd_policies import registered, released
from tests.app.service import Service
from tests.app.test_metrics import grown, scrape
from tests.catalogues import load, paper_example

PATIENCE = 60.0  # seconds


@pytest.fixture
def shaded(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """A service that chooses at random, and stores at once what shadows find."""
    monkeypatch.setattr(shadow_watch, "EVERY", 0.05)
    monkeypatch.setattr(shadow_watch, "MOST", 8)
    with registered(monkeypatch):
        service = Service.start(settings)
        try:
            load(service.client, paper_example(2))
            service.set_policy("random")
            yield service
        finally:
            released.set()
            service.stop()


def shadow(
    name: str, policy: dict[str, Any] = MYOPIC, sample: float = 1.0
) -> dict[str, Any]:
    return {"name": name, "policy": policy, "sample": sample}


def until(service: Service, decisions: int) -> dict[str, Any]:
    """The first shadow once so many of its decisions are stored."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        [first, *_] = report(service)["shadows"]
        if first["decisions"] == decisions:
            found: dict[str, Any] = first
            return found
        time.sleep(0.02)
    raise TimeoutError(f"the shadow never came to {decisions} decisions")


def test_a_shadow_tells_how_often_it_agrees_and_what_it_expects_to_gain(
    shaded: Service,
) -> None:
    before = scrape(shaded)
    begin(shaded, shadows=[shadow("now"), shadow("never", sample=1e-9)])
    made = []
    for number in range(30):
        made.append(shaded.next(f"user-{number % 10}", explain=True))
        shaded.answer(made[-1]["play"], "like")
        until(shaded, number + 1)  # in step: nothing is left out

    found = until(shaded, len(made))

    best = [
        max(group["like"] for group in play["explanation"]["candidates"])
        for play in made
    ]
    gains = [most - play["like"] for most, play in zip(best, made, strict=True)]
    agreed = sum(gain == 0 for gain in gains)
    assert found["agreement"]["value"] == pytest.approx(agreed / len(made))
    assert found["gain"]["value"] == pytest.approx(sum(gains) / len(made))
    assert found["gain"]["interval"][0] < found["gain"]["value"]
    assert found["policy"]["name"] == "myopic"
    after = scrape(shaded)
    decisions, likes = (
        "encore_shadow_decisions_total",
        "encore_shadow_expected_likes_total",
    )
    assert grown(before, after, decisions, shadow="now", agreed="yes") == agreed
    served = grown(before, after, likes, shadow="now", of="served")
    chosen = grown(before, after, likes, shadow="now", of="shadow")
    assert chosen - served == pytest.approx(sum(gains))
    assert {play["policy"]["name"] for play in made} == {"random"}


def test_what_a_shadow_found_outlives_the_process(shaded: Service) -> None:
    begin(shaded, arm("a", 0.5), arm("b", 0.5, RANDOM), shadows=[shadow("now")])
    shaded.next("ann", count=3)
    until(shaded, 1)

    again = Service.start(shaded.settings)
    again.next("ben")
    found = until(again, 2)
    again.stop()

    assert found["decisions"] == 2


def test_a_shadow_that_fails_or_sleeps_is_nobodys_trouble(shaded: Service) -> None:
    before = scrape(shaded)
    odd = [
        shadow("fails", {"name": "fails"}),
        shadow("unready", {"name": "fails", "params": {"where": "prepare"}}),
        shadow("sleeps", {"name": "sleeps"}),
    ]
    begin(shaded, shadows=odd)

    made = [shaded.next(f"user-{number}") for number in range(20)]
    skipped = "encore_shadow_misses_total"
    missed = scrape(shaded)
    released.set()
    shaded.next("late")

    assert {play["policy"]["name"] for play in made} == {"random"}
    for play in made[:5]:
        record = shaded.client.get(f"/v1/plays/{play['play']}").json()
        assert record["rung"] == 0
    assert grown(before, missed, skipped, shadow="sleeps", cause="skipped") > 0
    end = time.monotonic() + PATIENCE
    while not grown(before, scrape(shaded), skipped, shadow="unready", cause="failed"):
        assert time.monotonic() < end
    assert grown(before, scrape(shaded), skipped, shadow="fails", cause="failed") > 0
