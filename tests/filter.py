"""An independent filter: Bayes' rule in plain Python, written from docs/model.md.

It carries every item of one user, steps every one of them in every slot, and shares
nothing with the code under test.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any


class Filter:
    """The beliefs of one user about all items of a paper example."""

    def __init__(self, items: Sequence[Mapping[str, Any]]) -> None:
        self.items = {item["id"]: item for item in items}
        self.beliefs = {item["id"]: list(item["prior"]) for item in items}

    def take(self, played: str, signal: str) -> None:
        """One slot: the item played moves by its answer, all others rest."""
        self.take_together({played: signal})

    def take_together(self, signals: Mapping[str, str]) -> None:
        """One slot: the items played move by their answers, all others rest."""
        for name, item in self.items.items():
            belief = self.beliefs[name]
            if name in signals:
                self.beliefs[name] = after_play(item, belief, signals[name])
            else:
                self.beliefs[name] = moved(belief, item["rest"])

    def like(self, name: str) -> float:
        like = reward(self.items[name])
        return math.fsum(p * q for p, q in zip(self.beliefs[name], like, strict=True))


def after_play(
    item: Mapping[str, Any], belief: Sequence[float], signal: str
) -> list[float]:
    told = chances(item) | {"none": [1.0] * len(belief)}
    weights = told[signal]
    weighted = [p * w for p, w in zip(belief, weights, strict=True)]
    total = sum(weighted)
    return moved([p / total for p in weighted], item["play"])


def chances(item: Mapping[str, Any]) -> dict[str, list[float]]:
    """The chance of each signal, by state."""
    if "signals" not in item:
        like = item["like"]
        return {"skip": [1 - chance for chance in like], "like": like}
    columns = zip(*item["observe"], strict=True)
    return {
        name: list(column)
        for name, column in zip(item["signals"], columns, strict=True)
    }


def reward(item: Mapping[str, Any]) -> list[float]:
    """The expected reward of a play, by state."""
    if "signals" not in item:
        like: list[float] = item["like"]
        return like
    worth = item["reward"]
    return [
        math.fsum(p * w for p, w in zip(row, worth, strict=True))
        for row in item["observe"]
    ]


def moved(belief: Sequence[float], matrix: Sequence[Sequence[float]]) -> list[float]:
    states = range(len(belief))
    return [sum(belief[i] * matrix[i][j] for i in states) for j in states]
