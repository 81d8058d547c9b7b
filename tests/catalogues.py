"""Catalogues that many tests use."""

import json
from pathlib import Path
from typing import Any

import httpx


def paper_example(number: int) -> dict[str, Any]:
    """One of the examples of the paper, as typed and checked."""
    path = Path(__file__).parent / "policies" / "data" / f"example{number}.json"
    example: dict[str, Any] = json.loads(path.read_text())
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


def load(client: httpx.Client, paper: dict[str, Any]) -> None:
    """Put a paper example into a service, a model for each item."""
    for item in paper["items"]:
        model = {
            "states": paper["states"],
            "play": item["play"],
            "rest": item["rest"],
            "like": item["like"],
            "prior": item["initial_belief"],
        }
        client.put(f"/v1/models/{item['id']}", json=model).raise_for_status()
        fields = {"model": item["id"], "title": item["id"]}
        client.put(f"/v1/items/{item['id']}", json=fields).raise_for_status()
