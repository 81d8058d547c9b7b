"""Metrics as the service has them, and expressions as alerts have them."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

import yaml
from prometheus_client import Counter, Gauge, Histogram, Summary
from prometheus_client.metrics import MetricWrapperBase

from app import metrics
from tests.deploy.tools import DEPLOY

SUFFIXES: Mapping[type, tuple[str, ...]] = {
    Counter: ("_total",),
    Gauge: ("",),
    Histogram: ("_bucket", "_count", "_sum"),
    Summary: ("_count", "_sum"),
}
SELECTED = re.compile(r"\b(encore_\w+)(?:\{((?:[^}\"]|\"[^\"]*\")*)\})?")
LABEL = re.compile(r"(\w+)\s*(?:=~|!~|!=|=)")
GROUPED = re.compile(r"\b(?:by|without)\s*\(([^)]*)\)")
ADDED = {"instance", "job", "le"}  # by Prometheus, or by what it is


def series() -> dict[str, set[str]]:
    """Every name that `/metrics` may show, with its labels."""
    found = [m for m in vars(metrics).values() if isinstance(m, MetricWrapperBase)]
    return {
        metric._name + suffix: set(metric._labelnames)
        for metric in found
        for suffix in SUFFIXES[type(metric)]
    }


def selected(expression: str) -> Iterator[tuple[str, set[str]]]:
    """Which series an expression reads, and by which labels it chooses them."""
    for name, matchers in SELECTED.findall(expression):
        yield name, set(LABEL.findall(re.sub(r'"[^"]*"', '""', matchers)))


def grouped(expression: str) -> set[str]:
    """The labels by which an expression adds up."""
    lists = GROUPED.findall(expression)
    return {label.strip() for labels in lists for label in labels.split(",")}


def alerts() -> list[dict[str, Any]]:
    rules = yaml.safe_load((DEPLOY / "prometheus" / "alerts.yml").read_text())
    return [rule for group in rules["groups"] for rule in group["rules"]]


def dashboard() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DEPLOY / "grafana" / "encore.json").read_text())
    return found


def panels() -> list[dict[str, Any]]:
    return [panel for panel in dashboard()["panels"] if panel["type"] != "row"]


def expressions() -> dict[str, str]:
    """All of them, by where they stand."""
    shown = {
        f"{panel['title']} {target['refId']}": target["expr"]
        for panel in panels()
        for target in panel["targets"]
    }
    return shown | {alert["alert"]: alert["expr"] for alert in alerts()}
