"""Decisions in time: a policy that is too slow, or fails, holds nobody up."""

import asyncio
import threading
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest
import structlog
from sqlalchemy.util import greenlet_spawn

from app.api import observed
from app.logs import Seldom
from app.services import pace
from app.services.ladder import Cause
from app.services.pace import Pace
from app.settings import Settings
from app.storage import policies as stored
from app.storage.aside import Aside, Late
from app.storage.store import Store
from policies.exact_rollout import ExactRollout
from tests.app.guards import run
from tests.app.odd_policies import registered, released
from tests.app.replays import taken_again
from tests.app.service import Service
from tests.app.test_metrics import Samples, grown, scrape
from tests.catalogues import load, paper_example

Lines = list[dict[str, Any]]


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> Lines:
    """What is told of decisions."""
    found: Lines = []

    def note(_logger: object, method: str, line: Any) -> Any:  # noqa: ANN401
        found.append({**line, "method": method})
        raise structlog.DropEvent

    monkeypatch.setattr(observed, "logger", structlog.wrap_logger(None, [note]))
    monkeypatch.setattr(observed, "told", Seldom(60.0))
    return found


@pytest.fixture
def odd(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """A service that knows odd policies."""
    yield from serving(settings.with_changes(log_level="warning"), monkeypatch)


@pytest.fixture
def hurried(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """One that has little time for each decision, too."""
    changes = {"log_level": "warning", "decision_budget": 20}
    yield from serving(settings.with_changes(**changes), monkeypatch)


def serving(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    with registered(monkeypatch):
        service = Service.start(settings)
        try:
            load(service.client, paper_example(2))
            yield service
        finally:
            released.set()
            service.stop()


def rung_of(service: Service, play: dict[str, Any]) -> int:
    record = service.client.get(f"/v1/plays/{play['play']}").json()
    rung: int = record["rung"]
    return rung


def outcome(play: dict[str, Any]) -> tuple[str, tuple[str, float, float]]:
    return play["play"], (play["item"], play["like"], play["propensity"])


def degraded(before: Samples, after: Samples, rung: int, **labels: str) -> float:
    name = "encore_decisions_degraded_total"
    return grown(before, after, name, rung=str(rung), **labels)


@pytest.mark.parametrize("where", ["score", "prepare", "cost", "number"])
def test_a_policy_that_fails_fails_no_request(
    odd: Service, lines: Lines, where: str
) -> None:
    odd.set_policy("myopic")
    expected = [odd.next(f"plain-{number}")["item"] for number in range(2)]
    before = scrape(odd)
    version = odd.set_policy("fails", where=where)["version"]

    made = [odd.next("ann")]
    for signal in ("like", "skip", "none"):
        made.append(odd.answer(made[-1]["play"], signal, next=True)["next"])
    slate = odd.next("ben", count=3)["plays"]
    planned = odd.client.get("/v1/users/cat/playlist", params={"length": 2})

    assert made[0]["item"] == expected[0]
    assert {play["policy"]["name"] for play in made} == {"fails"}
    assert {rung_of(odd, play) for play in (*made, *slate)} == {1}
    assert planned.status_code == 200
    cause = {"policy": "fails", "cause": "failed"}
    assert degraded(before, scrape(odd), 1, **cause) == 4 + 1 + 2
    [line] = lines
    assert (line["method"], line["version"], line["rung"]) == ("error", version, 0)
    assert line["exc_info"].__traceback__ is not None
    odd.set_policy("random")
    assert taken_again(odd, [play["play"] for play in made]) == [*map(outcome, made)]
    assert taken_again(odd, [play["play"] for play in slate]) == [*map(outcome, slate)]


def test_a_policy_that_sleeps_holds_nobody_up(hurried: Service, lines: Lines) -> None:
    """It is not woken up before all is over: to wait for it would take a minute."""
    before = scrape(hurried)
    hurried.set_policy("sleeps")

    made = [hurried.next(f"user-{number}") for number in range(12)]

    after = scrape(hurried)
    assert {rung_of(hurried, play) for play in made} == {1}
    late = degraded(before, after, 1, policy="sleeps", cause="late")
    slow = degraded(before, after, 1, policy="sleeps", cause="slow")
    assert late >= 1
    assert slow >= 1
    assert late + slow == 12
    assert {line["cause"] for line in lines} == {"late", "slow"}
    assert len(lines) == 2
    assert taken_again(hurried, [play["play"] for play in made]) == [
        *map(outcome, made)
    ]


def test_a_policy_that_was_slow_is_tried_again_and_then_decides(
    hurried: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    hurried.set_policy("sleeps")
    asleep = rung_of(hurried, hurried.next("ann"))
    released.set()
    monkeypatch.setattr(pace, "HALF_LIFE", 1e-6)  # what was measured is soon forgotten
    monkeypatch.setattr(observed, "told", Seldom(0.0))

    awake = hurried.next("ben")
    while rung_of(hurried, awake) > 0:
        awake = hurried.answer(awake["play"], "like", next=True)["next"]

    assert asleep == 1
    released.set()
    assert taken_again(hurried, [awake["play"]]) == [outcome(awake)]


def test_a_policy_that_says_it_is_slow_is_not_asked(odd: Service) -> None:
    before = scrape(odd)
    odd.set_policy("sleeps", says=1e9)

    play = odd.next("ann")

    assert rung_of(odd, play) == 1
    cause = {"policy": "sleeps", "cause": "slow"}
    assert degraded(before, scrape(odd), 1, **cause) == 1


def test_with_time_enough_the_policy_itself_decides(example: Service) -> None:
    before = scrape(example)

    play = example.next("ann")

    assert rung_of(example, play) == 0
    degrading = "encore_decisions_degraded_total"
    assert {k: v for k, v in scrape(example).items() if k[0] == degrading} == {
        k: v for k, v in before.items() if k[0] == degrading
    }


@pytest.mark.parametrize(
    ("horizon", "expected"), [(12, 0), (1, 1), (0, 2)], ids=["all", "less", "none"]
)
def test_less_is_looked_ahead_where_there_is_less_time(
    example: Service, monkeypatch: pytest.MonkeyPatch, horizon: int, expected: int
) -> None:
    """As much as is said to be affordable; each rung's decision can be repeated."""

    def cost(policy: ExactRollout, _situation: object) -> float:
        return 1.0 if policy.horizon <= horizon else 1e12

    monkeypatch.setattr(ExactRollout, "cost", cost)
    example.set_policy("exact_rollout", base="best_fixed", leaf="none")

    made = [example.next("ann")]
    for signal in ("like", "skip", "skip", "none", "like"):
        made.append(example.answer(made[-1]["play"], signal, next=True)["next"])
    slate = example.next("ben", count=3)["plays"]

    assert {rung_of(example, play) for play in (*made, *slate)} == {expected}
    example.set_policy("random")
    plays = [*made, *slate]
    assert taken_again(example, [p["play"] for p in plays]) == [*map(outcome, plays)]


def test_a_rung_is_known_with_the_version_and_by_its_name(example: Service) -> None:
    example.set_policy("exact_rollout", base="myopic", leaf="none", depth=2)

    [version] = run(example, partial(stored.by_version, version=3))

    assert version is not None
    told = [(rung.name, rung.params.get("horizon")) for rung in version.rungs or ()]
    assert told == [
        ("exact_rollout", 3),
        ("exact_rollout", 1),
        ("myopic", None),
        ("random", None),
    ]


def test_a_policy_that_an_earlier_release_put_in_force_gets_rungs(
    example: Service,
) -> None:
    example.set_policy("rollout", trajectories=50)

    def forget(store: Store) -> None:
        store.write(stored.SET_RUNGS, {"of": 3, "to_rungs": None})

    run(example, forget)
    play = example.next("ann")
    Service.start(example.settings).stop()
    [version] = run(example, partial(stored.by_version, version=3))

    assert version is not None
    assert [rung.name for rung in version.rungs or ()] == [
        "rollout",
        "myopic",
        "random",
    ]
    assert taken_again(example, [play["play"]]) == [outcome(play)]


def test_pace_follows_what_is_measured_and_forgets_it_when_nothing_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 1000.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    followed = Pace()
    assert followed.foretell(50.0) == pytest.approx(50e-6)

    followed.learn(50.0, 50e-3)
    at_once = followed.foretell(50.0)
    for _ in range(100):
        followed.learn(50.0, 100e-6)
    in_the_end = followed.foretell(50.0)
    followed.learn(50.0, 1.0)
    after_a_stall = followed.foretell(50.0)
    now += 10 * pace.HALF_LIFE

    assert at_once == pytest.approx(50e-3)
    assert in_the_end == pytest.approx(100e-6, rel=0.01)
    assert after_a_stall < 1e-3
    assert followed.foretell(50.0) == pytest.approx(50e-6, rel=0.01)


def test_what_comes_late_is_given_up_and_what_waits_behind_it_never_begins() -> None:
    async def work() -> None:
        aside, release, begun = Aside(threads=1, most=9), threading.Event(), []
        try:
            for _ in range(3):
                with pytest.raises(Late):
                    await greenlet_spawn(
                        partial(aside.run, within=0.01, foretold=0.5),
                        lambda: begun.append(release.wait(60)),
                    )
            await asyncio.sleep(0.01)
            assert aside.backlog == 0.5
            release.set()
            assert await greenlet_spawn(aside.run, lambda: "again") == "again"
            assert begun == [True]
            assert aside.backlog == 0.0
        finally:
            release.set()
            aside.close()

    asyncio.run(work())


def test_an_error_that_comes_late_is_nobodys() -> None:
    async def work() -> None:
        aside, release = Aside(threads=1, most=9), threading.Event()

        def fail() -> None:
            release.wait(60)
            raise ZeroDivisionError

        with pytest.raises(Late):
            await greenlet_spawn(partial(aside.run, within=0.01), fail)
        release.set()
        assert await greenlet_spawn(aside.run, lambda: "again") == "again"
        aside.close()

    asyncio.run(work())


def test_a_line_of_a_kind_comes_through_once_and_counts_the_others() -> None:
    often = Seldom(0.0)
    seldom = Seldom(60.0)

    assert [often.take(Cause.LATE) for _ in range(3)] == [0, 0, 0]
    assert [seldom.take(kind) for kind in "aab"] == [0, None, 0]
    replaced = Seldom(60.0)
    replaced._last = {"a": -1e9}
    replaced._held = {"a": 7}
    assert replaced.take("a") == 7


def test_a_budget_that_is_none_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for value in ("0", "-1", "nan", "inf", "soon"):
        monkeypatch.setenv("ENCORE_DECISION_BUDGET", value)
        with pytest.raises(ValueError, match="decision_budget"):
            Settings()
