"""Catalogues that many tests use."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import httpx

from simulation.examples import DATA

Models = Sequence[Mapping[str, Any]]


def paper_example(number: int) -> Models:
    """One of the examples of the paper, as an import reads it."""
    example: Models = json.loads((DATA / f"example-{number}.json").read_text())
    return example


SIMPLE: dict[str, Any] = {
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.4, 0.6]],
    "rest": [[0.7, 0.3], [0.1, 0.9]],
    "like": [0.2, 0.8],
    "prior": [0.5, 0.5],
}

SERIES: dict[str, Any] = {
    "states": ["cold", "warm", "hot"],
    "play": [[0.8, 0.2, 0.0], [0.1, 0.6, 0.3], [0.0, 0.5, 0.5]],
    "rest": [[0.6, 0.3, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]],
    "signals": ["skip", "partial", "complete"],
    "observe": [[0.7, 0.2, 0.1], [0.3, 0.4, 0.3], [0.1, 0.1, 0.8]],
    "reward": [0, 0.4, 1],
    "prior": [0.2, 0.5, 0.3],
}


def load(client: httpx.Client, models: Models) -> None:
    """Put an item of each model into a service."""
    for model in models:
        name = model["id"]
        fields = {field: model[field] for field in model if field != "id"}
        client.put(f"/v1/models/{name}", json=fields).raise_for_status()
        item = {"model": name, "title": name}
        client.put(f"/v1/items/{name}", json=item).raise_for_status()
