"""Alerts and dashboard speak of what is counted; a real Prometheus reads them."""

import json
import re
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml

from tests.app.postgres import die_with_parent, free_port
from tests.app.service import ADMIN, client_of
from tests.app.workers import serving
from tests.catalogues import load, paper_example
from tests.deploy import watching
from tests.deploy.tools import DEPLOY, ROOT, passes, tool

RULES = DEPLOY / "prometheus"
EXPRESSIONS = watching.expressions()
VARIABLES = {"$job": "encore", "$instance": ".+", "$__rate_interval": "1m"}
# What an undisturbed service of two models has not to tell.
SILENT = {
    "Calibration error of models A",
    "Commits and units of work C",
    "Decisions taken by a lower rung A",
    "Index tables A",
    "Loss of models A",
    "Models in alarm A",
    "Shadows: agreement A",
    "Shadows: expected likes A",
    "Shadows: expected likes B",
}


@pytest.mark.parametrize("place", EXPRESSIONS)
def test_an_expression_reads_what_the_service_counts(place: str) -> None:
    series = watching.series()
    read = list(watching.selected(EXPRESSIONS[place]))

    labels = set[str]()
    for name, chosen in read:
        assert name in series
        assert chosen <= series[name] | watching.ADDED
        labels |= series[name]
    assert read or place == "EncoreDown"
    assert watching.grouped(EXPRESSIONS[place]) <= labels | watching.ADDED


def test_what_is_counted_is_shown() -> None:
    shown = {
        name
        for expression in EXPRESSIONS.values()
        for name, _ in watching.selected(expression)
    }
    for name in watching.series():
        base = name.removesuffix("_bucket").removesuffix("_count").removesuffix("_sum")
        assert any(one.startswith(base) for one in shown), name


def test_what_is_counted_is_explained() -> None:
    page = (ROOT / "docs" / "http-api.md").read_text()
    for name, labels in watching.series().items():
        base = re.sub("_(bucket|count|sum)$", "", name)
        [row] = re.findall(rf"^\| .*`{base}`.*$", page, re.MULTILINE)
        told = row.split("|")[2]
        assert set(re.findall(r"\w+", told)) == labels, name


def test_alerts_fire_where_they_should() -> None:
    passes("promtool", "check", "rules", "alerts.yml", cwd=RULES)
    passes("promtool", "test", "rules", "alerts_test.yml", cwd=RULES)


def test_every_alert_is_tested_and_explained() -> None:
    tests = yaml.safe_load((RULES / "alerts_test.yml").read_text())["tests"]
    fired = {
        rule["alertname"]
        for test in tests
        for rule in test.get("alert_rule_test", ())
        if rule["exp_alerts"]
    }
    explained = (ROOT / "docs" / "alerts.md").read_text()

    for alert in watching.alerts():
        assert alert["alert"] in fired
        assert f"## {alert['alert']}\n" in explained
        assert alert["labels"]["severity"] in {"critical", "warning"}
        assert alert["annotations"]["summary"]
    assert explained.count("\n## ") == len(watching.alerts())


def test_what_is_scraped_is_what_alerts_ask_for() -> None:
    passes("promtool", "check", "config", RULES / "prometheus.yml")
    config = yaml.safe_load((RULES / "prometheus.yml").read_text())

    assert "encore" in {job["job_name"] for job in config["scrape_configs"]}


def test_panels_lie_side_by_side() -> None:
    panels = watching.dashboard()["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels)
    places = [panel["gridPos"] for panel in panels]
    for one in places:
        assert 0 <= one["x"] < one["x"] + one["w"] <= 24
    for one, other in combinations(places, 2):
        beside = (
            one["x"] + one["w"] <= other["x"] or other["x"] + other["w"] <= one["x"]
        )
        above = one["y"] + one["h"] <= other["y"] or other["y"] + other["h"] <= one["y"]
        assert beside or above


def test_panels_ask_the_source_that_is_chosen() -> None:
    source = {"type": "prometheus", "uid": "${datasource}"}
    for panel in watching.panels():
        assert panel["datasource"] == source
        for target in panel["targets"]:
            assert target["datasource"] == source
            assert '{job=~"$job", instance=~"$instance"' in target["expr"]


@contextmanager
def prometheus(folder: Path, target: str) -> Iterator[httpx.Client]:
    """A Prometheus that scrapes a service each second, by the rules of deploy/."""
    config = yaml.safe_load((RULES / "prometheus.yml").read_text())
    config["global"] = {"scrape_interval": "1s", "evaluation_interval": "1s"}
    config["rule_files"] = [str(RULES / "alerts.yml")]
    config["scrape_configs"] = [
        {"job_name": "encore", "static_configs": [{"targets": [target]}]}
    ]
    (folder / "prometheus.yml").write_text(json.dumps(config))
    port = free_port()
    process = subprocess.Popen(
        [
            tool("prometheus"),
            f"--config.file={folder}/prometheus.yml",
            f"--storage.tsdb.path={folder}/data",
            f"--web.listen-address=127.0.0.1:{port}",
            "--log.level=error",
        ],
        preexec_fn=die_with_parent,  # noqa: PLW1509 - no threads run in the child
    )
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}") as client:
            yield client
    finally:
        process.terminate()
        process.wait(30)


def query(client: httpx.Client, expression: str) -> list[dict[str, Any]]:
    answer = client.get("/api/v1/query", params={"query": expression})
    assert answer.status_code == 200, (expression, answer.text)
    found: list[dict[str, Any]] = answer.json()["data"]["result"]
    return found


def until_scraped(client: httpx.Client) -> None:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        try:
            if query(client, "changes(encore_cpu_seconds_total[1m]) > 1"):
                return
        except (httpx.TransportError, AssertionError):
            pass  # it starts
        time.sleep(0.2)
    raise TimeoutError


def listen(url: str) -> None:
    """Listeners who answer, some of them wrongly."""

    def one(number: int) -> None:
        with client_of(url, ADMIN) as client:
            for _ in range(5):
                play = client.get(f"/v1/users/user-{number}/next").json()["play"]
                address = f"/v1/plays/{play}/feedback"
                client.post(address, json={"signal": "like"}).raise_for_status()
                client.post(address, json={"signal": "skip"})

    with ThreadPoolExecutor(8) as threads:
        list(threads.map(one, range(16)))


def test_a_prometheus_finds_what_alerts_and_dashboard_ask_for(
    postgres_url: str, tmp_path: Path
) -> None:
    with serving(postgres_url, workers=2) as running:
        load(running.client, paper_example(2))
        url = str(running.client.base_url)
        with prometheus(tmp_path, url.removeprefix("http://")) as client:
            until_scraped(client)
            listen(url)
            time.sleep(3)  # a rate needs two scrapes
            found = {}
            for panel in watching.panels():
                for target in panel["targets"]:
                    expression = target["expr"]
                    for name, value in VARIABLES.items():
                        expression = expression.replace(name, value)
                    found[f"{panel['title']} {target['refId']}"] = query(
                        client, expression
                    )
            groups = client.get("/api/v1/rules").json()["data"]["groups"]

    rules = [rule for group in groups for rule in group["rules"]]
    assert {rule["health"] for rule in rules} == {"ok"}
    assert {rule["name"] for rule in rules if rule["state"] == "firing"} == set()
    assert {place for place, result in found.items() if not result} <= SILENT
