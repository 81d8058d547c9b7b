"""The command `encore simulate`, also called `encore bound`."""

import json
import os
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.app.commands import Encore, Said, start
from tests.app.service import Service
from tests.catalogues import SIMPLE, paper_example

QUICK = ("--runs", 40, "--slots", 30)
OPTIMUM = 8.986321013  # of example 2


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """Example 2 of the paper, as models."""
    return write(tmp_path, *paper_example(2))


def write(folder: Path, *models: Mapping[str, Any]) -> Path:
    file = folder / "models.ndjson"
    file.write_text("".join(json.dumps(model) + "\n" for model in models))
    return file


def tried(*policies: str) -> list[str]:
    return [word for policy in policies for word in ("--policy", policy)]


def test_no_policy_earns_more_than_the_bound(encore: Encore, models: Path) -> None:
    policies = tried("random", "best_fixed", "myopic")

    told = encore(
        "simulate", "--models", models, *policies, "--runs", 200, "--json"
    ).json

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
    words = ("simulate", "--models", models, *tried("random", rollout), *QUICK)

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
        told = encore("simulate", *words, "--json").json
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

    told = encore("simulate", *at, *QUICK, "--json").json

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
    said = encore("simulate", "--database-url", database_url)

    assert said == Said(1, "", "Error: There are no items to play.\n")


def test_an_example_of_the_paper_is_tried_by_its_number(
    encore: Encore, models: Path
) -> None:
    words = (*tried("whittle", "myopic"), "--runs", 400, "--json")

    told = encore("simulate", "--example", 2, *words).json
    same = encore("bound", "--models", models, *words).json

    whittle, myopic = told["policies"]
    assert (told["example"], told["start"], told["score"]) == (2, "belief", "expected")
    assert told["models"] == [f"item-{number}" for number in range(1, 6)]
    assert whittle["mean"] == pytest.approx(OPTIMUM, abs=0.02)
    assert myopic["difference"] < -0.5
    assert whittle["play_shares"][3] > 0.95
    assert sum(myopic["play_shares"][place] for place in (2, 4)) > 0.95
    assert same["example"] is None
    for one, other in zip(told["policies"], same["policies"], strict=True):
        assert one["mean"] == other["mean"]


def test_the_papers_listeners_begin_where_no_bound_holds(encore: Encore) -> None:
    words = ("simulate", "--example", 3, "--start", "state", *tried("myopic"))

    clicks = encore(*words, "--score", "clicks", *QUICK, "--json").json
    shown = encore(*words, *QUICK)

    [myopic] = clicks["policies"]
    assert (clicks["bound"], clicks["price"]) == (None, None)
    assert (myopic["gap"], myopic["gap_percent"]) == (None, None)
    assert clicks["score"] == "clicks"
    assert "there is no bound" in shown.out
    assert "myopic plays item-" in shown.out


def test_the_fourth_example_is_drawn_by_the_seed(encore: Encore) -> None:
    def means(seed: int) -> list[float]:
        words = ("simulate", "--example", 4, *tried("myopic"), *QUICK, "--seed", seed)
        told = encore(*words, "--json").json
        assert len(told["models"]) == 15
        return [each["mean"] for each in told["policies"]]

    assert means(1) == means(1) != means(2)


def test_runs_go_on_where_others_have_ended(encore: Encore) -> None:
    def mean(first: int, runs: int) -> float:
        words = ("simulate", "--example", 2, *tried("myopic"), "--first", first)
        told = encore(*words, "--runs", runs, "--slots", 20, "--json").json
        [myopic] = told["policies"]
        return float(myopic["mean"])

    assert mean(0, 30) == pytest.approx((mean(0, 10) + 2 * mean(10, 20)) / 3)


def test_a_catalogue_and_policies_are_read_as_the_service_has_them(
    encore: Encore, tmp_path: Path
) -> None:
    """JSON, YAML and NDJSON say the same."""
    good, poor = ({"id": name, **SIMPLE} for name in ("good", "poor"))
    items: list[dict[str, object]] = [{"id": name, "model": "good"} for name in "ab"]
    items.append({"id": "c", "model": "poor", "active": False})
    (tmp_path / "models.yaml").write_text(yaml.safe_dump([good, poor]))
    (tmp_path / "items.json").write_text(json.dumps(items))
    (tmp_path / "policies.yml").write_text(
        "- name: myopic\n"
        "- name: exact_rollout\n"
        "  params: {horizon: 1, base: [myopic, best_fixed], leaf: none}\n"
        "  note: as it is stored\n"
    )

    told = encore(
        *("simulate", "--models", tmp_path / "models.yaml"),
        *("--items", tmp_path / "items.json"),
        *("--policies", tmp_path / "policies.yml"),
        *(*QUICK, "--json"),
    ).json

    assert (told["models"], told["items"]) == (["good"], [2])
    assert [each["name"] for each in told["policies"]] == ["myopic", "exact_rollout"]
    assert told["policies"][1]["params"]["base"] == ["myopic", "best_fixed"]


def test_what_is_wrong_with_items_and_policies_is_named(
    encore: Encore, models: Path, tmp_path: Path
) -> None:
    items = [{"id": "a", "model": "item-1"}] * 2 + [{"id": "b", "model": "none"}]
    (tmp_path / "items.json").write_text(json.dumps(items))
    (tmp_path / "policies.yaml").write_text(
        "[{name: guess}, {name: myopic, params: {horizon: 1}}, {name: rollout, no: 1}]"
    )
    at = ("simulate", "--models", models)

    catalogue = encore(*at, "--items", tmp_path / "items.json")
    policies = encore(*at, "--policies", tmp_path / "policies.yaml")

    assert (catalogue.status, policies.status) == (1, 1)
    assert "entry 2: id: is there twice\n" in catalogue.err
    assert "entry 3: model: unknown model 'none'\n" in catalogue.err
    assert "entry 1: name: must be one of random, " in policies.err
    assert "entry 2: horizon: myopic has no such parameter\n" in policies.err
    assert "entry 3: no: " in policies.err


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--example", 1, "--models", "m.json"), "--example does not go with --models"),
        (("--models", "m.json", "--database-url", "sqlite:///x"), "--models does not"),
        (("--items", "i.json"), "--items goes with --models."),
        (("--start", "state"), "--start state: only --example 1, 2, 3 have states."),
        (("--example", 4, "--start", "state"), "--start state: only --example 1, 2"),
        (("--example", 1, "--first", 2**31), "--first: must be from 0 to 2**31 less"),
    ],
)
def test_options_that_do_not_go_together_are_named(
    encore: Encore, words: tuple[object, ...], complaint: str
) -> None:
    said = encore("simulate", *words)

    assert (said.status, said.out) == (2, "")
    assert said.err.startswith(f"Error: {complaint}")


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
    said = encore("simulate", "--models", models, *words)

    assert (said.status, said.out) == (2, "")
    assert said.err.startswith(f"Error: {complaint}")
    assert said.err.count("\n") == 1


@pytest.mark.parametrize("name", ["missing.ndjson", "models.pdf", "models.csv"])
def test_a_file_that_cannot_be_read_is_told(encore: Encore, name: str) -> None:
    said = encore("simulate", "--models", name)

    assert said.status == 2
    assert said.err.startswith("Error: ")
    assert said.err.count("\n") == 1


def test_lines_that_are_no_models_are_named(encore: Encore, tmp_path: Path) -> None:
    good = {"id": "a", **SIMPLE}
    file = write(tmp_path, good, good, good | {"id": "b", "prior": [1, 1]}, {"id": "c"})

    said = encore("simulate", "--models", file)

    assert said.status == 1
    assert "line 2: id: is there twice\n" in said.err
    assert "line 3: prior: sums to 2, not to 1\n" in said.err
    assert "line 4: play: " in said.err
    assert said.err.splitlines()[-1].startswith("Error: The file has ")


def test_what_would_take_days_is_refused(encore: Encore, tmp_path: Path) -> None:
    file = write(tmp_path, *({"id": f"m{i}", **SIMPLE} for i in range(20)))
    words = ("simulate", "--models", file, *tried("rollout"))

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
    words = ("simulate", "--models", models, *policies, "--runs", 1_000_000)
    cache = {"NUMBA_CACHE_DIR": os.environ["NUMBA_CACHE_DIR"]}
    with start(*words, cwd=tmp_path, extra=cache) as process:
        assert process.stderr is not None
        told = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)

    assert told.startswith("About ")
    assert told.endswith(" minutes (5 models, 1000000 runs).\n")
    assert (process.returncode, out, err) == (130, "", "")
