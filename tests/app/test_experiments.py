"""Experiments: users split between policies, for everybody and for good."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from tests.app.experimenting import (
    EXPERIMENT,
    MYOPIC,
    RANDOM,
    arm,
    arms_of,
    begin,
    end,
    report,
    told,
)
from tests.app.replays import taken_again
from tests.app.service import ADMIN, Service, client_of
from tests.catalogues import SIMPLE

USERS = [f"user-{number}" for number in range(60)]


def test_users_stay_in_their_arm_in_every_process_and_after_a_restart(
    example: Service,
) -> None:
    version = example.set_policy("best_fixed")["version"]
    begun = begin(
        example, arm("now", 0.4, MYOPIC), arm("any", 0.4, RANDOM), holdout=0.2
    )
    policies = {each["name"]: each["policy"] for each in begun["arms"]}
    first = arms_of(example, USERS)
    example.stop()

    again, other = (Service.start(example.settings) for _ in range(2))
    for number, user in enumerate(USERS):
        process = (again, other)[number % 2]
        play = process.next(user)
        record = told(process.client.get(f"/v1/plays/{play['play']}"))
        assert record["arm"] == first[user]
        assert record["experiment"] == begun["version"]
        expected = policies[record["arm"]] or {"version": version, "name": "best_fixed"}
        assert record["policy"] == expected["version"]
        assert play["policy"]["name"] == expected["name"]
        process.answer(play["play"], "like")
    assert arms_of(other, USERS) == first
    again.stop()
    other.stop()

    spread = Counter(first.values())
    assert set(spread) == {"now", "any", "holdout"}
    assert policies["now"]["version"] == version + 1
    assert policies["any"]["version"] == version + 2
    assert policies["holdout"] is None


def test_a_change_of_shares_moves_nobody_who_need_not(example: Service) -> None:
    begin(example, arm("a", 0.5), arm("b", 0.5, RANDOM))
    before = arms_of(example, USERS)

    changed = begin(
        example, arm("a", 0.5), arm("b", 0.3, RANDOM), arm("c", 0.2, MYOPIC)
    )
    for user in USERS:
        example.answer(example.next(user)["play"], "like")
    after = arms_of(example, USERS)

    assert (changed["version"], changed["origin"]) == (2, 1)
    moved = {(before[user], after[user]) for user in USERS} - {
        (name, name) for name in "abc"
    }
    assert moved == {("b", "c")}
    assert report(example, version=1)["ended_at"] == changed["started_at"]


def test_what_arms_decided_can_be_decided_again(example: Service) -> None:
    begin(
        example,
        arm("a", 0.3),
        arm("b", 0.3, {"name": "rollout", "params": {"trajectories": 20}}),
        arm("c", 0.4, {"name": "epsilon", "params": {"epsilon": 0.5}}),
    )
    made = []
    for user in USERS[:12]:
        for signal in ("like", "skip"):
            made.append(example.next(user))
            example.answer(made[-1]["play"], signal)
    end(example)
    example.set_policy("random")
    example.put_model("item-1", SIMPLE)

    assert {play["policy"]["name"] for play in made} == {"myopic", "rollout", "epsilon"}
    for play, again in taken_again(example, [play["play"] for play in made]):
        [shown] = [one for one in made if one["play"] == play]
        assert again == (shown["item"], shown["like"], shown["propensity"])
        record = example.client.get(f"/v1/plays/{play}", params={"explain": True})
        assert record.json()["explanation"]["candidates"][0]["item"] == shown["item"]


def test_swaps_and_experiments_do_not_get_into_each_others_way(
    example: Service,
) -> None:
    begin(example, arm("as-ever", 0.5), arm("any", 0.5, RANDOM))
    swapped = example.set_policy("best_fixed")
    served = {
        (
            example.client.get(f"/v1/plays/{play['play']}").json()["arm"],
            play["policy"]["name"],
        )
        for play in map(example.next, USERS)
    }
    during = report(example)
    back = example.client.post("/v1/admin/policy/rollback").json()
    ended = end(example, "enough")
    example.set_policy("random")
    later = report(example)

    assert served == {("as-ever", "best_fixed"), ("any", "random")}
    assert (swapped["version"], back["version"], back["restores"]) == (4, 5, 2)
    assert "best_fixed" in during["warnings"][0]
    assert ended["warnings"] == later["warnings"] == during["warnings"]
    assert (ended["running"], ended["ended_note"]) == (False, "enough")
    for user in USERS:
        example.answer(example.next(user)["play"], "like")
        assert example.next(user)["policy"] == {"version": 6, "name": "random"}
    history = example.client.get("/v1/admin/policies").json()["policies"]
    assert [each["version"] for each in history] == [6, 5, 4, 2, 1]


def test_at_the_same_time_swaps_and_changes_all_get_a_version(
    example: Service,
) -> None:
    def swap(number: int) -> dict[str, Any]:
        with client_of(example.url, ADMIN) as client:
            form = {"name": "myopic", "note": str(number)}
            return told(client.put("/v1/admin/policy", json=form))

    def split(number: int) -> dict[str, Any]:
        arms = [arm("a", 0.5), arm(f"b-{number}", 0.5, RANDOM)]
        with client_of(example.url, ADMIN) as client:
            return told(client.put(EXPERIMENT, json={"name": "trial", "arms": arms}))

    with ThreadPoolExecutor(8) as threads:
        swaps = [threads.submit(swap, number) for number in range(8)]
        splits = [threads.submit(split, number) for number in range(8)]
        put = [done.result()["version"] for done in swaps]
        begun = [done.result() for done in splits]

    own = [each["arms"][1]["policy"]["version"] for each in begun]
    assert sorted([*put, *own]) == list(range(3, 19))
    assert sorted(each["version"] for each in begun) == list(range(1, 9))


def test_what_is_no_experiment_is_refused_by_field_and_changes_nothing(
    example: Service,
) -> None:
    half = [arm("a", 0.5), arm("b", 0.5, RANDOM)]
    wrong: dict[str, list[Any]] = {
        "name": [{"arms": half}, {"name": "", "arms": half}, {"name": "A b"}],
        "arms": [
            {"name": "x"},
            {"name": "x", "arms": [arm("a", 1.0)]},
            {"name": "x", "arms": [arm("a", 0.5), arm("b", 0.4)]},
            {"name": "x", "arms": half, "holdout": 0.1},
            {"name": "x", "arms": [arm(f"a{n}", 1 / 21) for n in range(21)]},
        ],
        "arms.1.name": [
            {"name": "x", "arms": [arm("a", 0.5), arm("a", 0.5)]},
            {"name": "x", "arms": [arm("a", 0.5), arm("holdout", 0.5)]},
            {"name": "x", "arms": [arm("a", 0.5), arm("\x00", 0.5)]},
            {"name": "x", "arms": [arm("a", 0.5), arm("b" * 65, 0.5)]},
        ],
        "arms.1.share": [
            {"name": "x", "arms": [arm("a", 0.991), arm("b", 0.009)]},
            {"name": "x", "arms": [arm("a", 1), {"name": "b", "share": "0"}]},
            {"name": "x", "arms": [arm("a", 1), {"name": "b", "share": True}]},
            {"name": "x", "arms": [arm("a", 1), {"name": "b"}]},
            {"name": "x", "arms": [arm("a", 1), arm("b", -0.5)]},
            {"name": "x", "arms": [arm("a", 1), arm("b", 10**400)]},
        ],
        "holdout": [
            {"name": "x", "arms": half, "holdout": 1.5},
            {"name": "x", "arms": [arm("a", 0.991)], "holdout": 0.009},
        ],
        "control": [
            {"name": "x", "arms": half, "control": "c"},
            {"name": "x", "arms": half, "control": "holdout"},
        ],
        "arms.1.policy.name": [
            {"name": "x", "arms": [arm("a", 0.5), arm("b", 0.5, {"name": "best"})]},
            {"name": "x", "arms": [arm("a", 0.5), arm("b", 0.5, {})]},
        ],
        "arms.1.policy.params.horizon": [
            {"name": "x", "arms": [half[0], arm("b", 0.5, rollout(horizon=0))]},
        ],
        "arms.1.policy.params.trajectories": [
            {
                "name": "x",
                "arms": [
                    half[0],
                    arm("b", 0.5, rollout(horizon=50, trajectories=10_000)),
                ],
            },
        ],
        "shadows.0.policy": [{"name": "x", "shadows": [{"name": "s"}]}],
        "shadows.0.sample": [
            {"name": "x", "shadows": [{"name": "s", "policy": MYOPIC, "sample": 0}]},
        ],
        "shadows.1.name": [
            {"name": "x", "shadows": [{"name": "s", "policy": MYOPIC}] * 2},
        ],
        "why": [{"name": "x", "arms": half, "why": "x"}],
        "body": [[], None, 1],
    }
    for field, forms in wrong.items():
        for form in forms:
            answer = example.client.put(EXPERIMENT, json=form)
            assert answer.status_code == 422, form
            assert answer.json()["code"] in {"invalid_experiment", "invalid_request"}
            assert [e["field"] for e in answer.json()["errors"]] == [field], form

    assert example.client.get(EXPERIMENT).json()["code"] == "experiment_not_found"
    assert example.client.delete(EXPERIMENT).status_code == 404
    assert example.client.get(EXPERIMENT, params={"version": 7}).status_code == 404
    assert example.set_policy("random")["version"] == 3


def rollout(**params: object) -> dict[str, Any]:
    return {"name": "rollout", "params": params}


def test_what_is_compared_is_fixed_while_it_runs(example: Service) -> None:
    planner = rollout(horizon=3)
    begin(example, arm("a", 0.5), arm("b", 0.5, planner))
    now = [arm("a", 0.5), arm("c", 0.5, MYOPIC)]
    begin(example, *now)
    forms: list[tuple[str, str, dict[str, Any]]] = [
        ("experiment_runs", "name", {"name": "other", "arms": now}),
        ("experiment_fixed", "arms.1.policy", {"arms": [now[0], arm("b", 0.5)]}),
        (
            "experiment_fixed",
            "arms.0.policy",
            {"arms": [arm("a", 0.5, RANDOM), now[1]]},
        ),
        ("experiment_fixed", "control", {"arms": now, "control": "c"}),
    ]

    for code, field, form in forms:
        answer = example.client.put(EXPERIMENT, json={"name": "trial", **form})
        assert (answer.status_code, answer.json()["code"]) == (409, code)
        assert [e["field"] for e in answer.json()["errors"]] == [field]

    again = begin(example, arm("a", 0.5), arm("b", 0.5, planner))
    assert again["version"] == 3
    assert again["arms"][1]["policy"]["version"] == 3


def test_history_tells_who_began_and_ended_what_and_why(example: Service) -> None:
    key = example.client.get("/v1/admin/keys").json()["keys"][0]["id"]
    begin(example, arm("a", 0.5), arm("b", 0.5, RANDOM), note="first")
    begin(example, arm("a", 0.9), arm("b", 0.1, RANDOM), note="too many skips")
    end(example, "it is worse")
    begin(example, arm("a", 0.5), arm("b", 0.5, MYOPIC), note="another")

    found: list[dict[str, Any]] = []
    params: dict[str, Any] = {"limit": 2}
    while params.get("cursor", "") is not None:
        page = told(example.client.get("/v1/admin/experiments", params=params))
        found += page["experiments"]
        params["cursor"] = page["next"]

    assert [(e["version"], e["origin"], e["note"]) for e in found] == [
        (4, 4, "another"),
        (2, 1, "too many skips"),
        (1, 1, "first"),
    ]
    assert [e["ended_note"] for e in found] == [None, "it is worse", "too many skips"]
    assert {e["by"] for e in found} == {key}
    assert found[0]["ended_at"] is None
    assert found[1]["shares"] == {"a": 0.9, "b": 0.1}
