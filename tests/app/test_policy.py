"""The policy in force: swapped live, kept in history, rolled back."""

from dataclasses import dataclass
from operator import itemgetter
from typing import Annotated, Any, ClassVar, Literal

import pytest
from pydantic import TypeAdapter, ValidationError

from app.api.schemas.policy import PolicyForm, chosen_by_name, forms_of
from app.services.policy_catalogue import choices
from policies import NEVER, POLICIES, Bounds, Floats, ModelSet, Scorer, Situation
from tests.app.service import Service

DEFAULT = {
    "base": ["whittle", "lagrangian"],
    "horizon": 3,
    "depth": 1,
    "leaf": "lagrangian",
    "discount": 0.95,
}
ROLLOUT = {
    "base": "myopic",
    "horizon": 5,
    "trajectories": 100,
    "discount": 0.95,
    "reward": "expected",
    "common_random_numbers": True,
    "reading": "tail",
    "allocation": "equal",
}


def test_a_swap_is_complete_obeyed_at_once_and_survives_a_restart(
    example: Service,
) -> None:
    first = example.client.get("/v1/admin/policy").json()
    before = example.next("ann")

    swapped = example.set_policy("rollout", horizon=3)
    after = example.next("ben")

    assert before["policy"] == {"version": first["version"], "name": "myopic"}
    assert swapped["params"] == ROLLOUT | {"horizon": 3}
    assert swapped["version"] == first["version"] + 1
    assert swapped["note"] == "test"
    assert after["policy"] == {"version": swapped["version"], "name": "rollout"}
    again = Service.start(example.settings)
    try:
        assert again.client.get("/v1/admin/policy").json() == swapped
    finally:
        again.stop()


def test_a_swap_is_obeyed_by_another_worker_on_its_next_request(
    example: Service,
) -> None:
    other = Service.start(example.settings)
    try:
        assert other.next("ann")["policy"]["name"] == "myopic"

        version = example.set_policy("round_robin")["version"]

        assert other.next("ben")["policy"] == {
            "version": version,
            "name": "round_robin",
        }
    finally:
        other.stop()


def test_a_swap_loses_no_belief(example: Service) -> None:
    for signal in ("like", "skip", "none", "like"):
        example.answer(example.next("ann")["play"], signal)
    believed = example.beliefs("ann")
    pending = example.next("ann")

    example.set_policy("random")

    assert example.beliefs("ann") == believed
    assert example.next("ann") == pending | {"pending": True}


def test_history_tells_who_and_why_and_a_rollback_goes_back_step_by_step(
    service: Service,
) -> None:
    client = service.client
    key = client.get("/v1/admin/keys").json()["keys"][0]["id"]
    service.set_policy("myopic")
    service.set_policy("best_fixed", discount=0)

    back = client.post("/v1/admin/policy/rollback", json={"note": "too greedy"}).json()
    further = client.post("/v1/admin/policy/rollback").json()
    beyond = client.post("/v1/admin/policy/rollback")

    assert (back["version"], back["name"], back["restores"]) == (4, "myopic", 2)
    assert (back["note"], back["by"]) == ("too greedy", key)
    assert (further["name"], further["restores"]) == ("exact_rollout", 1)
    assert further["params"] == DEFAULT
    assert beyond.status_code == 409
    assert beyond.json()["code"] == "no_earlier_policy"
    assert pages(service, limit=2) == [
        (5, "exact_rollout", key),
        (4, "myopic", key),
        (3, "best_fixed", key),
        (2, "myopic", key),
        (1, "exact_rollout", "encore"),
    ]
    assert client.get("/v1/admin/policy").json() == further


def pages(service: Service, limit: int) -> list[tuple[int, str, str]]:
    found = []
    params: dict[str, Any] = {"limit": limit}
    while True:
        page = service.client.get("/v1/admin/policies", params=params).json()
        found += [(p["version"], p["name"], p["by"]) for p in page["policies"]]
        if page["next"] is None:
            return found
        params["cursor"] = page["next"]


def test_what_is_wrong_is_refused_by_field_and_changes_nothing(
    service: Service,
) -> None:
    wrong: dict[str, list[Any]] = {
        "name": [{}, {"name": "best"}, {"name": 1}, {"name": None}],
        "params.horizon": [
            rollout(horizon=0),
            rollout(horizon=51),
            rollout(horizon="5"),
            rollout(horizon=True),
            rollout(horizon=2.5),
            rollout(horizon=10**30),
        ],
        "params.discount": [
            rollout(discount=1),
            rollout(discount=-0.1),
            rollout(discount=False),
            rollout(discount=None),
        ],
        "params.base": [rollout(base="greedy"), rollout(base=1)],
        "params.common_random_numbers": [rollout(common_random_numbers=1)],
        "params.steps": [rollout(steps=3)],
        "params.epsilon": [epsilon(epsilon=1.1), epsilon(epsilon="0.1")],
        "params.policy": [
            epsilon(policy=None),
            epsilon(policy="myopic"),
            epsilon(policy=[]),
        ],
        "params.policy.name": [
            epsilon(policy={}),
            epsilon(policy={"name": "epsilon"}),
            epsilon(policy={"name": "thompson"}),
            epsilon(policy={"name": "\x00"}),
            epsilon(policy={"name": 1}),
        ],
        "params.policy.note": [epsilon(policy={"name": "myopic", "note": "x"})],
        "params.policy.params": [epsilon(policy={"name": "myopic", "params": []})],
        "params.policy.params.horizon": [
            epsilon(policy=rollout(horizon=0)),
            epsilon(policy=rollout(horizon=True)),
        ],
        "params.policy.params.trajectories": [
            epsilon(policy=rollout(horizon=50, trajectories=10_000)),
        ],
        "params": [{"name": "myopic", "params": []}, {"name": "myopic", "params": 1}],
        "note": [
            {"name": "myopic", "note": "\x00"},
            {"name": "myopic", "note": "x" * 1001},
            {"name": "myopic", "note": None},
        ],
        "why": [{"name": "myopic", "why": "x"}],
        "body": [[], "myopic", None, 1],
    }
    before = service.client.get("/v1/admin/policy").json()

    for field, forms in wrong.items():
        for form in forms:
            answer = service.client.put("/v1/admin/policy", json=form)
            assert answer.status_code == 422, form
            assert [e["field"] for e in answer.json()["errors"]] == [field], form

    assert service.client.get("/v1/admin/policy").json() == before


def rollout(**params: object) -> dict[str, Any]:
    return {"name": "rollout", "params": params}


def epsilon(**params: object) -> dict[str, Any]:
    return {"name": "epsilon", "params": params}


def test_an_unknown_name_is_told_the_known_ones(service: Service) -> None:
    answer = service.client.put("/v1/admin/policy", json={"name": "best"})

    (fault,) = answer.json()["errors"]
    assert all(name in fault["message"] for name in POLICIES)


def test_the_document_shows_every_policy_with_its_parameters(service: Service) -> None:
    document = service.client.get("/openapi.json").json()

    swap = document["paths"]["/v1/admin/policy"]["put"]
    form = swap["requestBody"]["content"]["application/json"]["schema"]
    schemas = document["components"]["schemas"]
    assert set(form["discriminator"]["mapping"]) == set(POLICIES)
    assert len(form["oneOf"]) == len(POLICIES)
    horizon = schemas["RolloutParams"]["properties"]["horizon"]
    assert (horizon["minimum"], horizon["maximum"]) == (1, 50)
    assert (horizon["type"], horizon["default"]) == ("integer", 5)
    assert horizon["description"]
    base = schemas["RolloutParams"]["properties"]["base"]
    assert {"random", "myopic", "whittle"} <= set(base["enum"])
    assert schemas["RolloutPolicy"]["properties"]["params"]["default"] == ROLLOUT


def test_a_policy_that_another_follows_is_documented(service: Service) -> None:
    document = service.client.get("/openapi.json").json()

    schemas = document["components"]["schemas"]
    followed = schemas["EpsilonParams"]["properties"]["policy"]
    assert followed["default"] == {"name": "myopic", "params": {}}
    known = followed["discriminator"]["mapping"]
    assert set(known) < set(POLICIES)
    assert not {"epsilon", "thompson"} & set(known)
    form = schemas[known["rollout"].rpartition("/")[2]]
    assert form["properties"]["params"]["default"] == ROLLOUT
    assert "note" not in form["properties"]


def test_exploring_tells_the_chance_of_every_play(example: Service) -> None:
    """Of five items, one is the best for all new users: it is played 6 in 10 times."""
    swapped = example.set_policy("epsilon", epsilon=0.5, policy={"name": "myopic"})

    plays = [example.next(f"user-{number}") for number in range(60)]

    assert swapped["params"] == {
        "epsilon": 0.5,
        "policy": {"name": "myopic", "params": {}},
    }
    listed = example.client.get("/v1/admin/policies").json()["policies"][0]
    assert swapped == swapped | listed
    assert swapped == example.client.get("/v1/admin/policy").json()
    best = max(plays, key=itemgetter("like"))["item"]
    chance = {play["item"]: play["propensity"] for play in plays}
    assert chance[best] == pytest.approx(0.6)
    assert set(chance) > {best}
    assert all(value == 0.1 for item, value in chance.items() if item != best)
    assert 20 <= sum(play["item"] == best for play in plays) <= 52
    for play in plays[:10]:
        address = f"/v1/plays/{play['play']}"
        record = example.client.get(address, params={"explain": True}).json()
        first, *others = record["explanation"]["candidates"]
        assert first["item"] == play["item"]
        assert all(first["score"] >= other["score"] for other in others)


def test_parameters_of_the_policy_followed_are_completed(service: Service) -> None:
    swapped = service.set_policy("epsilon", policy=rollout(horizon=3))

    followed = {"name": "rollout", "params": ROLLOUT | {"horizon": 3}}
    assert swapped["params"] == {"epsilon": 0.1, "policy": followed}


@dataclass(frozen=True, slots=True)
class Patient:
    """Waits before an item is played again."""

    rest_matters: ClassVar[bool] = True

    pause: Annotated[int, Bounds(0, 100), "slots to wait"] = 7
    mood: Annotated[Literal["calm", "strict"], "how it waits"] = "calm"

    def prepare(self, _models: ModelSet) -> Scorer:
        return self._scores

    def cost(self, _situation: Situation) -> float:
        return 1.0

    def _scores(self, situation: Situation, _seed: int) -> Floats:
        waited = situation.rested >= min(self.pause, NEVER)
        scores: Floats = waited.astype(float)
        return scores


def test_one_more_policy_is_accepted_and_documented_by_its_registration() -> None:
    registered = {**POLICIES, "patient": Patient}
    forms = forms_of(choices(registered))
    adapter: TypeAdapter[PolicyForm] = TypeAdapter(
        Annotated[PolicyForm, chosen_by_name(forms)]
    )

    form = adapter.validate_python({"name": "patient", "params": {"mood": "strict"}})

    assert form.params.model_dump() == {"pause": 7, "mood": "strict"}
    with pytest.raises(ValidationError) as refused:
        adapter.validate_python({"name": "patient", "params": {"pause": 101}})
    assert refused.value.errors()[0]["loc"] == ("params", "pause")
    schemas = adapter.json_schema()["$defs"]
    assert schemas["PatientPolicy"]["description"] == Patient.__doc__
    assert schemas["PatientParams"]["properties"]["pause"] == {
        "type": "integer",
        "title": "Pause",
        "description": "slots to wait",
        "default": 7,
        "minimum": 0,
        "maximum": 100,
    }


def test_parameters_that_are_too_much_together_are_refused(service: Service) -> None:
    params = {"horizon": 50, "trajectories": 10_000}

    refused = service.client.put(
        "/v1/admin/policy", json={"name": "rollout", "params": params}
    )

    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "params.trajectories"
