"""The command `encore bound`."""

import json
import os
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from tests.app.commands import Encore, Said, start
from tests.app.service import Service
from tests.catalogues import SIMPLE, paper_example

QUICK = ("--runs", 40, "--slots", 30)
OPTIMUM = 8.986321013  # of example 2


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """Example 2 of the paper, as models."""
    paper = paper_example(2)
    shared = {"states": paper["states"]}
    return write(
        tmp_path,
        *(
            shared
            | {name: item[name] for name in ("id", "play", "rest", "like")}
            | {"prior": item["initial_belief"]}
            for item in paper["items"]
        ),
    )


def write(folder: Path, *models: Mapping[str, Any]) -> Path:
    file = folder / "models.ndjson"
    file.write_text("".join(json.dumps(model) + "\n" for model in models))
    return file


def tried(*policies: str) -> list[str]:
    return [word for policy in policies for word in ("--policy", policy)]


def test_no_policy_earns_more_than_the_bound(encore: Encore, models: Path) -> None:
    policies = tried("random", "best_fixed", "myopic")

    told = encore("bound", "--models", models, *policies, "--runs", 200, "--json").json

    assert OPTIMUM < told["bound"] < OPTIMUM + 1e-5
    assert told["slots"] == 180
    assert 0 < told["remainder"] < 0.01
    assert told["items"] == [1] * 5
    assert [each["name"] for each in told["policies"]] == [
        "random",
        "best_fixed",
        "myopic",
    ]
    first = told["policies"][0]["mean"]
    for each in told["policies"]:
        assert each["mean"] - 2 * each["ci95"] < told["bound"]
        assert each["gap"] == pytest.approx(told["bound"] - each["mean"])
        assert each["difference"] == pytest.approx(each["mean"] - first)
        assert each["decision_us"] > 0
        assert sum(each["play_shares"]) == pytest.approx(1)
    fixed = told["policies"][1]
    assert fixed["mean"] == pytest.approx(8.9508, abs=2 * fixed["ci95"])


def test_people_are_shown_what_programs_are_told(encore: Encore, models: Path) -> None:
    rollout = 'exact_rollout={"horizon":1}'
    words = ("bound", "--models", models, *tried("random", rollout), *QUICK)

    shown, told = encore(*words), encore(*words, "--json").json

    assert shown.err == ""
    assert [each["label"] for each in told["policies"]] == ["random", rollout]
    for each in told["policies"]:
        assert f"{each['mean']:.4f} ± {each['ci95']:.4f}" in shown.out
        assert f"{each['gap']:.4f} ({each['gap_percent']:.2f} %)" in shown.out
    assert f"No policy earns more than {told['bound']:.4f} on average." in shown.out


def test_the_same_seed_gives_the_same_rewards(encore: Encore, models: Path) -> None:
    def rewards(seed: int) -> list[float]:
        words = ("--models", models, *tried("myopic"), *QUICK, "--seed", seed)
        told = encore("bound", *words, "--json").json
        return [each["mean"] for each in told["policies"]]

    assert rewards(3) == rewards(3) != rewards(4)


def test_the_active_items_of_the_database_are_tried_with_the_policy_in_force(
    encore: Encore, service: Service
) -> None:
    for name, like in (("good", [0.8, 0.9]), ("poor", [0.1, 0.3])):
        service.put_model(name, SIMPLE | {"like": like})
    for item, model in (("a", "good"), ("b", "poor"), ("c", "poor"), ("d", "poor")):
        service.put_item(item, model)
    service.client.delete("/v1/items/d").raise_for_status()
    service.set_policy("exact_rollout", horizon=1, discount=0.5)
    at = ("--database-url", service.settings.database_url)

    told = encore("bound", *at, *QUICK, "--json").json

    by_model = dict(zip(told["models"], told["items"], strict=True))
    assert by_model == {"good": 1, "poor": 2}
    present, *usual = told["policies"]
    assert present["label"] == "exact_rollout (in force)"
    assert present["params"]["horizon"] == 1
    assert present["params"]["discount"] == 0.5
    assert {"random", "best_fixed", "myopic", "whittle", "exact_rollout"} == {
        each["label"] for each in usual
    }


def test_an_empty_database_has_nothing_to_bound(
    encore: Encore, database_url: str
) -> None:
    said = encore("bound", "--database-url", database_url)

    assert said == Said(1, "", "Error: There are no items to play.\n")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--discount", 1), "--discount: must be from 0 to 0.999, not 1.0."),
        (("--discount", "nan"), "--discount: must be from 0 to 0.999, not nan."),
        (("--runs", 1), "--runs: must be from 2 to below 2**31, not 1."),
        (("--slots", 10**20), f"--slots: must be from 1 to below 2**31, not {10**20}."),
        (("--seed", -1), "--seed: must be from 0 to below 2**63, not -1."),
        (tried("guess"), "--policy guess: name: must be one of random, "),
        (tried("whittle={"), "--policy whittle: is no JSON: "),
        (tried("whittle=[]"), "--policy whittle: is no JSON object."),
        (tried("whittle=" + "[" * 100_000), "--policy whittle: is nested too deeply."),
        (
            tried('whittle={"discount": 1}'),
            "--policy whittle: discount: must be a number from 0 to 0.999, not 1.",
        ),
        (
            tried('myopic={"horizon": 2}'),
            "--policy myopic: horizon: myopic has no such parameter.",
        ),
    ],
)
def test_an_option_that_makes_no_sense_is_named(
    encore: Encore, models: Path, words: tuple[object, ...], complaint: str
) -> None:
    said = encore("bound", "--models", models, *words)

    assert (said.status, said.out) == (2, "")
    assert said.err.startswith(f"Error: {complaint}")
    assert said.err.count("\n") == 1


@pytest.mark.parametrize("name", ["missing.ndjson", "models.pdf", "models.csv"])
def test_a_file_that_cannot_be_read_is_told(encore: Encore, name: str) -> None:
    said = encore("bound", "--models", name)

    assert said.status == 2
    assert said.err.startswith("Error: ")
    assert said.err.count("\n") == 1


def test_lines_that_are_no_models_are_named(encore: Encore, tmp_path: Path) -> None:
    good = {"id": "a", **SIMPLE}
    file = write(tmp_path, good, good, good | {"id": "b", "prior": [1, 1]}, {"id": "c"})

    said = encore("bound", "--models", file)

    assert said.status == 1
    assert "line 2: id: is there twice\n" in said.err
    assert "line 3: prior: sums to 2, not to 1\n" in said.err
    assert "line 4: play: " in said.err
    assert said.err.splitlines()[-1].startswith("Error: The file has ")


def test_what_would_take_days_is_refused(encore: Encore, tmp_path: Path) -> None:
    file = write(tmp_path, *({"id": f"m{i}", **SIMPLE} for i in range(20)))
    words = ("bound", "--models", file, *tried("rollout"))

    deep = encore(*words, "--depth", 6)
    long = encore(*words, "--runs", 10**8)

    assert (deep.status, long.status) == (1, 1)
    assert "--depth: too deep for 20 models." in deep.err
    assert "days (20 models, 100000000 runs): ask for fewer --runs" in long.err
    assert deep.err.count("\n") == long.err.count("\n") == 1


def test_what_takes_minutes_is_told_beforehand_and_can_be_stopped(
    models: Path, tmp_path: Path
) -> None:
    policies = tried("exact_rollout")
    words = ("bound", "--models", models, *policies, "--runs", 1_000_000)
    cache = {"NUMBA_CACHE_DIR": os.environ["NUMBA_CACHE_DIR"]}
    with start(*words, cwd=tmp_path, extra=cache) as process:
        assert process.stderr is not None
        told = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)

    assert told.startswith("About ")
    assert told.endswith(" minutes (5 models, 1000000 runs).\n")
    assert (process.returncode, out, err) == (130, "", "")
