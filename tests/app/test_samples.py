"""Models with samples, over HTTP: what is not known of a model, and `thompson`."""

import json
import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.app.commands import Encore
from tests.app.indexes import building, present_policy, report, until
from tests.app.replays import taken_again
from tests.app.service import Service
from tests.app.test_audits import audit, rebuild
from tests.catalogues import SERIES, SIMPLE
from tests.filter import Filter, chances

DRAWN = np.random.default_rng(7)
STEEP = {
    "play": [[0.7, 0.3], [0.2, 0.8]],
    "rest": [[0.9, 0.1], [0.5, 0.5]],
    "prior": [0.9, 0.1],
    "like": [0.4, 0.95],
}
CHAIN = ("play", "rest", "prior", "like", "observe")
SONG: dict[str, Any] = SIMPLE | {
    "samples": [{name: SIMPLE[name] for name in CHAIN[:4]}, STEEP]
}
SHOW: dict[str, Any] = SERIES | {
    "samples": [
        {
            "play": DRAWN.dirichlet(np.ones(3), 3).tolist(),
            "rest": DRAWN.dirichlet(np.ones(3), 3).tolist(),
            "prior": DRAWN.dirichlet(np.ones(3)).tolist(),
            "observe": DRAWN.dirichlet(np.ones(3), 3).tolist(),
        }
        for _ in range(3)
    ]
}
MOOD: dict[str, Any] = {"answers": 1, "memory": None, "levels": [], "pause_s": None}
MOODY: dict[str, Any] = {
    **{name: SIMPLE[name] for name in ("states", *CHAIN[:3])},
    "mood": MOOD | {"like": DRAWN.random((3, 2)).tolist()},
    "samples": [
        {
            **{name: SIMPLE[name] for name in CHAIN[:3]},
            "mood": {"like": DRAWN.random((3, 2)).tolist()},
        }
        for _ in range(2)
    ],
}
CATALOGUE = {"song": SONG, "show": SHOW, "plain": SIMPLE}
FOLLOWING = {"name": "myopic"}


def together(model: Mapping[str, Any]) -> dict[str, Any]:
    """All samples as one chain over pairs of a sample and a state."""
    samples: Sequence[Mapping[str, Any]] = model.get("samples", [model])
    size = len(model["states"])
    chain: dict[str, Any] = {"id": ""}
    for name in ("play", "rest"):
        matrix = np.zeros((len(samples) * size,) * 2)
        for number, sample in enumerate(samples):
            own = slice(number * size, (number + 1) * size)
            matrix[own, own] = sample[name]
        chain[name] = matrix.tolist()
    chain["prior"] = [p / len(samples) for sample in samples for p in sample["prior"]]
    for name in ("like", "observe"):
        if name in samples[0]:
            chain[name] = [each for sample in samples for each in sample[name]]
    told = {name: model[name] for name in ("signals", "reward") if name in model}
    return chain | told


def oracle() -> Filter:
    return Filter(
        [{**together(model), "id": name} for name, model in CATALOGUE.items()]
    )


def by_state(name: str, belief: Sequence[float]) -> list[float]:
    states = len(CATALOGUE[name]["states"])
    folded: list[float] = np.reshape(belief, (-1, states)).sum(axis=0).tolist()
    return folded


@pytest.fixture
def sampled(service: Service) -> Service:
    """A service with two items of each model, and `thompson` in force."""
    service.set_policy("thompson", policy=FOLLOWING)
    for name, model in CATALOGUE.items():
        service.put_model(name, model)
        service.put_item(name, name)
    return service


def test_beliefs_learn_which_sample_is_true(sampled: Service) -> None:
    expected, chance = oracle(), random.Random(3)  # noqa: S311 - a listener

    play = sampled.next("ann")
    for _ in range(40):
        item = play["item"]
        assert play["like"] == pytest.approx(expected.like(item), abs=1e-9)
        believed = expected.beliefs[item]
        told = chances(expected.items[item]) | {"none": [0.1] * len(believed)}
        weights = [float(np.dot(believed, told[name])) for name in told]
        [signal] = chance.choices(list(told), weights)
        play = sampled.answer(play["play"], signal, next=True)["next"]
        expected.take(item, signal)

    held = sampled.beliefs("ann", item=list(CATALOGUE))
    for each in held["beliefs"]:
        name = each["item"]
        belief = by_state(name, expected.beliefs[name])
        assert each["belief"] == pytest.approx(belief, abs=1e-9)
        assert each["like"] == pytest.approx(expected.like(name), abs=1e-9)
    [audited] = audit(sampled)
    assert (audited.stale, audited.findings) == (False, [])
    before = sampled.beliefs("ann")
    rebuild(sampled)
    assert sampled.beliefs("ann") == before


def test_what_is_drawn_is_told_and_can_be_drawn_again(sampled: Service) -> None:
    for name in ("other", "third"):
        sampled.put_item(name, "song")
    chosen: dict[str, tuple[str, float, float]] = {}
    for _ in range(12):
        told = sampled.next("ann", count=2)
        for play in told["plays"]:
            chosen[play["play"]] = (play["item"], play["like"], play["propensity"])
            sampled.answer(play["play"], "skip")

    assert dict(taken_again(sampled, list(chosen))) == chosen
    assert len({item for item, _, _ in chosen.values()}) > 2
    assert min(propensity for _, _, propensity in chosen.values()) < 0.9
    last = [*chosen][-1]
    record = sampled.client.get(f"/v1/plays/{last}", params={"explain": True}).json()
    for group in record["explanation"]["candidates"]:
        assert len(group["belief"]) == len(group["states"])
        assert sum(group["belief"]) == pytest.approx(1)


@pytest.mark.parametrize("model", [SONG, SHOW, MOODY], ids=["like", "signals", "mood"])
def test_what_is_told_of_samples_is_complete(
    service: Service, model: dict[str, Any], encore: Encore, tmp_path: Path
) -> None:
    service.set_policy("thompson", policy=FOLLOWING)
    service.put_model("song", model)

    view = service.client.get("/v1/models/song").json()
    again = service.client.put("/v1/models/song", json=model)

    assert again.json()["version"] == view["version"] == 1
    for told, given in zip(view["samples"], model["samples"], strict=True):
        known = {name: value for name, value in told.items() if value is not None}
        mood = known.pop("mood", None)
        if mood is not None:
            known["mood"] = {name: value for name, value in mood.items() if value}
        assert known == given
    at = ("--database-url", service.settings.database_url)
    assert encore("export", "models", tmp_path / "models.ndjson", *at).status == 0
    line = json.loads((tmp_path / "models.ndjson").read_text())
    assert line.pop("source") == ""
    assert line == {"id": "song", **model}
    changed = service.client.put(
        "/v1/models/song", json=model | {"samples": model["samples"][:1]}
    )
    assert changed.json()["version"] == 2


def of_sample(**fields: object) -> dict[str, Any]:
    first = {**SONG["samples"][0], **fields}
    kept = {name: value for name, value in first.items() if value != "left out"}
    return SONG | {"samples": [STEEP, kept]}


@pytest.mark.parametrize(
    ("model", "field", "code"),
    [
        (of_sample(like="left out"), "samples.1.like", "invalid_model"),
        (of_sample(observe=[[0.5, 0.5]] * 2), "samples.1.observe", "invalid_model"),
        (of_sample(like=[0.1, 0.2, 0.3]), "samples.1.like", "invalid_model"),
        (of_sample(like=[0.1, 2]), "samples.1.like.1", "invalid_request"),
        (of_sample(play=[[1, 0], [0.5, 0.4]]), "samples.1.play.1", "invalid_model"),
        (of_sample(rest="left out"), "samples.1.rest", "invalid_request"),
        (of_sample(prior=[0.5, 0.6]), "samples.1.prior", "invalid_model"),
        (of_sample(states=["a", "b"]), "samples.1.states", "invalid_request"),
        (of_sample(mood={"like": [[0.1, 0.2]]}), "samples.1.like", "invalid_model"),
        (SONG | {"samples": []}, "samples", "invalid_request"),
        (SONG | {"samples": [STEEP] * 33}, "samples", "invalid_request"),
        (SHOW | {"samples": SHOW["samples"] * 8}, "samples", "invalid_model"),
        (SHOW | {"samples": [STEEP]}, "samples.0.observe", "invalid_model"),
        (
            MOODY | {"samples": [{**MOODY["samples"][0], "mood": {"like": [[1, 1]]}}]},
            "samples.0.mood.like",
            "invalid_model",
        ),
        (MOODY | {"samples": [STEEP]}, "samples.0.mood.like", "invalid_model"),
    ],
)
def test_samples_that_are_none_are_refused(
    service: Service, model: dict[str, Any], field: str, code: str
) -> None:
    service.set_policy("myopic")

    refused = service.client.put("/v1/models/song", json=model)

    assert refused.status_code == 422, refused.text
    problem = refused.json()
    assert (problem["code"], problem["errors"][0]["field"]) == (code, field)
    assert service.client.get("/v1/models/song").status_code == 404


def refused(answer: httpx.Response) -> tuple[int, str, list[str]]:
    problem = answer.json()
    named = [fault["value"] for fault in problem.get("errors", [])]
    return answer.status_code, problem["code"], named


def test_policies_that_need_one_table_for_all_samples_are_refused(
    service: Service, encore: Encore, tmp_path: Path
) -> None:
    service.set_policy("whittle")
    service.put_model("plain", SIMPLE)
    none = (409, "samples_apart", ["song"])
    file = tmp_path / "models.ndjson"
    file.write_text(json.dumps({"id": "song", **SONG}))
    at = ("--database-url", service.settings.database_url)

    assert refused(service.client.put("/v1/models/song", json=SONG)) == none
    said = encore("import", "models", file, *at)
    assert said.status == 1
    assert "thompson" in said.err

    service.set_policy("thompson", policy={"name": "whittle"})
    service.put_model("song", SONG)
    assert present_policy(service.client)["tables"] == {"ready": 0, "rough": 2, "of": 2}
    swapped = service.client.put("/v1/admin/policy", json={"name": "whittle"})
    assert refused(swapped) == none
    assert refused(service.client.post("/v1/admin/policy/rollback", json={})) == none
    assert present_policy(service.client)["name"] == "thompson"
    for name in ("epsilon", "myopic", "round_robin"):
        service.set_policy(name)


def test_each_sample_gets_a_table_of_its_own(service: Service) -> None:
    service.set_policy("thompson", policy={"name": "whittle"})
    service.put_model("song", SONG)
    for item in ("a", "b"):
        service.put_item(item, "song")
    rough = service.next("ann")["play"]
    before = report(service.client, "song")
    assert (before["state"], before["precision"]) == ("waiting", "rough")

    with building(service.settings) as builder:
        ready = until(builder.client, "song", "ready")

    assert (ready["progress"], ready["precision"]) == (1.0, "full")
    assert present_policy(service.client)["tables"] == {"ready": 1, "rough": 0, "of": 1}
    full = service.next("ben")["play"]
    chosen = [service.client.get(f"/v1/plays/{play}").json() for play in (rough, full)]
    again = [outcome for _, outcome in taken_again(service, [rough, full])]
    assert again == [
        (play["item"], play["like"], play["propensity"]) for play in chosen
    ]


def test_a_service_that_begins_with_samples_needs_no_table_for_all_of_them(
    service: Service,
) -> None:
    service.set_policy("myopic")
    service.put_model("song", SONG)
    service.put_item("a", "song")
    assert report(service.client, "song")["state"] == "none"

    service.set_policy("exact_rollout", base="myopic", leaf="none")

    assert service.next("ann")["item"] == "a"
