"""The demo: a service in one command, and listeners who live with each policy."""

import asyncio
import json
import shlex
import signal
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import httpx
import numpy as np
import pytest

from app.api.schemas.items import ItemView
from app.api.schemas.model_views import ModelView
from app.cli.session import Session, perform
from app.demo import catalogue, trial
from app.demo.client import Client
from app.demo.listeners import Listener, Nature
from app.demo.trial import Lived, Trial
from app.domain import Described
from app.services.policy import current, swap
from tests.app.commands import Encore, start
from tests.app.service import ADMIN, Service
from tests.catalogues import paper_example

T = TypeVar("T")


@pytest.fixture
def demo(service: Service) -> Service:
    """A service with the demo's catalogue."""
    perform(
        service.settings,
        lambda session: catalogue.ensure(session.database, session.live),
    )
    return service


def test_the_calls_that_are_printed_work_when_pasted(tmp_path: Path) -> None:
    known = {"ENCORE_BOOTSTRAP_KEY": ADMIN}
    with start("demo", "--port", 0, cwd=tmp_path, extra=known) as process:
        assert process.stdout is not None
        printed: list[str] = []
        while not (printed and "/v1/admin/policy" in printed[-1]):
            printed.append(process.stdout.readline())
        upcoming, taken, policy = (
            paste(line) for line in printed if line.startswith("curl ")
        )
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=60)

    assert f"Admin key  {ADMIN}\n" in printed
    assert upcoming["user"] == "ann"
    assert (taken["play"], taken["signal"]) == (upcoming["play"], "like")
    assert taken["next"]["slot"] == 1
    assert policy["name"] == "myopic"
    assert process.returncode == 0
    assert "Traceback" not in complaint
    assert (tmp_path / "encore-demo.db").exists()


def test_a_demo_started_again_goes_on_with_new_keys(tmp_path: Path) -> None:
    words = ("demo", "--port", 0, "--exit", "--json")

    first = report_of(*words, cwd=tmp_path)
    again = report_of(*words, "--listeners", 2, "--plays", 3, cwd=tmp_path)

    assert first["policies"] == []
    assert again["admin_key"] != first["admin_key"]
    plays = {policy["policy"]: policy["plays"] for policy in again["policies"]}
    assert plays == dict.fromkeys(trial.POLICIES, 6)
    assert (
        again["curl"][1].split("/plays/")[1][:36]
        == (first["curl"][1].split("/plays/")[1][:36])
    )


def test_listeners_live_with_each_policy(demo: Service, encore: Encore) -> None:
    before = demo.client.get("/v1/admin/policy").json()
    wanted = Trial(10, 30, seed=1, policies=("random", "best_fixed", "rollout"))

    lived = asyncio.run(lives(demo, wanted))

    rate = {each.policy: each.like_rate for each in lived}
    assert list(rate) == ["random", "best_fixed", "rollout"]
    for each in lived:
        assert each.plays == each.slots == 300
        assert each.likes == round(each.like_rate * each.plays)
        assert 0 <= each.like_rate <= 1
        assert each.ci95 is not None
        assert each.decision_ms is not None
    assert rate["rollout"] > rate["random"]
    assert demo.client.get("/v1/admin/policy").json()["name"] == before["name"]
    audited = encore("audit", "--database-url", demo.settings.database_url, "--json")
    assert audited.json["users"] == 30
    assert audited.json["findings"] == []


def test_a_trial_cut_short_leaves_no_policy_behind(demo: Service) -> None:
    def cut_short(name: str) -> None:
        put = partial(swap, described=Described(name, {}), note=trial.NOTE, by="a test")
        in_database(demo, put)

    demo.set_policy("myopic")
    cut_short("random")
    cut_short("round_robin")

    in_database(demo, partial(trial.clean_up, by="a test"))
    in_database(demo, partial(trial.clean_up, by="a test"))

    now = in_database(demo, current)
    assert (now.version.name, now.version.version) == ("myopic", 5)


def test_the_catalogue_is_loaded_once(demo: Service) -> None:
    perform(
        demo.settings, lambda session: catalogue.ensure(session.database, session.live)
    )

    items = demo.client.get("/v1/items", params={"limit": 1000}).json()["items"]
    tags = Counter(item["tags"][0] for item in items)
    assert tags == {
        "paper": 5,
        "anthem": 15,
        "earworm": 15,
        "ambient": 15,
        "grower": 15,
    }
    assert len({item["title"] for item in items}) == 65
    revision = demo.client.get("/v1/models/paper-1").json()["version"]
    assert revision == 1


def test_the_catalogue_holds_the_papers_numbers(demo: Service) -> None:
    for number, item in enumerate(paper_example(2), start=1):
        held = demo.client.get(f"/v1/models/paper-{number}").json()

        assert held["play"] == item["play"]
        assert held["rest"] == item["rest"]
        assert held["like"] == item["like"]
        assert held["prior"] == item["prior"]


def test_interest_moves_as_the_models_say() -> None:
    """Item a: liked every other time. Item b: liked once it has rested twice."""
    swaps = [[0.0, 1.0], [1.0, 0.0]]
    stays = [[1.0, 0.0], [0.0, 1.0]]
    climbs = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    falls = [[1.0, 0.0, 0.0]] * 3
    nature = Nature.of(
        [
            model("two", swaps, stays, [0, 1], [1, 0]),
            model("three", falls, climbs, [0, 0, 1], [1, 0, 0]),
        ],
        [item("a", "two"), item("b", "three")],
    )
    listener = Listener(nature, np.random.default_rng(0))

    heard = [listener.hear(name) for name in "aaabbaab"]

    assert [each.signal for each in heard] == ["skip", "like"] * 4
    assert [each.reward for each in heard] == [0, 1] * 4


def test_listeners_answer_with_the_signals_of_the_model() -> None:
    stays = np.eye(3).tolist()
    plain = model("plain", stays, stays, [0, 1, 1], [0, 1, 0])
    told = model("told", stays, stays, [0, 0.5, 1], [0, 1, 0]).model_copy(
        update={
            "signals": ["skip", "partial", "complete"],
            "observe": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "reward": [0, 0.5, 1],
        }
    )
    nature = Nature.of([plain, told], [item("a", "told"), item("b", "plain")])
    listener = Listener(nature, np.random.default_rng(0))

    assert [listener.hear(name) for name in "ab"] == [("partial", 0.5), ("like", 1)]


def test_listeners_of_one_seed_are_the_same() -> None:
    even = [[0.5, 0.5], [0.5, 0.5]]
    nature = Nature.of(
        [model("m", even, even, [0.3, 0.7], [0.5, 0.5])], [item("a", "m")]
    )

    def heard() -> list[float]:
        listener = Listener(nature, np.random.default_rng([3, 1]))
        return [listener.hear("a").reward for _ in range(50)]

    first = heard()
    assert first == heard()
    assert 0 < sum(first) < 50


async def lives(service: Service, wanted: Trial) -> list[Lived]:
    heard: Counter[str] = Counter()
    async with Client(service.url, ADMIN) as client:
        lived = [
            each
            async for each in trial.run(client, wanted, lambda p: heard.update([p]))
        ]
    assert set(heard.values()) == {wanted.listeners * wanted.plays}
    return lived


def in_database(service: Service, work: Callable[..., T]) -> T:
    async def task(session: Session) -> T:
        return await session.database.run(work)

    return perform(service.settings, task)


def report_of(*words: object, cwd: Path) -> Any:  # noqa: ANN401 - whatever it is
    with start(*words, cwd=cwd) as process:
        printed, complaint = process.communicate(timeout=120)
    assert process.returncode == 0, complaint
    return json.loads(printed)


def paste(line: str) -> Any:  # noqa: ANN401 - whatever it is
    """Do what curl would, also where there is no curl."""
    words = iter(shlex.split(line)[1:])
    method, headers, body, url = "GET", {}, None, ""
    for word in words:
        match word:
            case "-X":
                method = next(words)
            case "-H":
                name, _, value = next(words).partition(": ")
                headers[name] = value
            case "-d":
                body = next(words)
                method = "POST" if method == "GET" else method
            case "-w":
                next(words)
            case "-sS":
                pass
            case _:
                url = word
    answer = httpx.request(
        method, url, headers=headers, content=body, timeout=60, trust_env=False
    )
    assert answer.is_success, answer.text
    return answer.json()


def model(
    name: str,
    play: list[list[float]],
    rest: list[list[float]],
    like: list[float],
    prior: list[float],
) -> ModelView:
    return ModelView(
        id=name,
        version=1,
        states=[str(number) for number in range(len(like))],
        play=play,
        rest=rest,
        like=like,
        prior=prior,
        source="",
        signals=["skip", "like"],
        observe=[[1 - chance, chance] for chance in like],
        reward=[0, 1],
        fractions=None,
        mood=None,
        samples=None,
        created_at=datetime.now(UTC),
        warnings=[],
    )


def item(name: str, model_id: str) -> ItemView:
    now = datetime.now(UTC)
    return ItemView(
        id=name,
        model=model_id,
        title=name,
        tags=[],
        payload={},
        active=True,
        created_at=now,
        updated_at=now,
    )
