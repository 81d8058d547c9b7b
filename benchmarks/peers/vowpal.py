"""Vowpal Wabbit's contextual bandit: one action an item, described by its history."""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

import numpy as np
from vowpalwabbit import Workspace

from benchmarks.peers.competitor import SESSIONS, Competitor, learners
from benchmarks.peers.worlds import ITEMS

COMMON = "--cb_explore_adf --bit_precision 14 --interactions is --quiet"
SLOW = "--power_t 0 --learning_rate 0.05"
SETTINGS: Mapping[str, tuple[str, bool]] = MappingProxyType(
    {
        "epsilon 0.02": ("--epsilon 0.02", False),
        "epsilon 0.02, slow": (f"--epsilon 0.02 {SLOW}", False),
        "epsilon 0.02, slow, counts": (f"--epsilon 0.02 {SLOW}", True),
        "squarecb, gamma 100": ("--squarecb --gamma_scale 100", False),
        "squarecb, counts": ("--squarecb", True),
    }
)
EVEN = [1 / ITEMS] * ITEMS
FADING = 0.3  # weight of the last answer
LATELY = 12  # slots


class History:
    """What one listener did with one item so far."""

    def __init__(self) -> None:
        self.slots: list[int] = []
        self.likes = 0
        self.fading = 0.5
        self.last = "never"

    def take(self, slot: int, *, liked: bool) -> None:
        self.slots.append(slot)
        self.likes += liked
        self.fading += FADING * (liked - self.fading)
        self.last = "like" if liked else "skip"

    def features(self, slot: int) -> str:
        since = str((slot - self.slots[-1]).bit_length()) if self.slots else "never"
        rate = (self.likes + 1) / (len(self.slots) + 2)
        return (
            f"since={since} last={self.last} both={since}{self.last}"
            f" rate:{rate:.3f} fading:{self.fading:.3f}"
        )

    def count(self, slot: int) -> str:
        lately = sum(slot - played <= LATELY for played in self.slots[-LATELY:])
        return f" lately={lately} lately:{lately / 4}"


class Vowpal:
    def __init__(self, options: str, seed: int, *, counts: bool) -> None:
        self.workspace = Workspace(f"{COMMON} {options} --random_seed {seed}")
        self.rng = np.random.default_rng(seed)
        self.counts = counts
        self.greet()

    def greet(self) -> None:
        self.slot = 0
        self.histories = [History() for _ in range(ITEMS)]
        self.chances = EVEN

    def choose(self) -> int:
        self.chances = self.workspace.predict(self.actions())
        return int(np.searchsorted(np.cumsum(self.chances)[:-1], self.rng.random()))

    def learn(self, item: int, *, liked: bool) -> None:
        actions = self.actions()
        label = f"0:{-int(liked)}:{self.chances[item]:.6f}"
        actions[item] = f"{label} {actions[item]}"
        self.workspace.learn(actions)
        self.histories[item].take(self.slot, liked=liked)
        self.slot += 1

    def actions(self) -> list[str]:
        return [self.action(item) for item in range(ITEMS)]

    def action(self, item: int) -> str:
        history = self.histories[item]
        count = history.count(self.slot) if self.counts else ""
        return f"|i item={item} |s {history.features(self.slot)}{count}"


def competitors() -> list[Competitor]:
    settings = {
        name: partial(Vowpal, options, counts=counts)
        for name, (options, counts) in SETTINGS.items()
    }
    return learners("Vowpal Wabbit", settings, [SESSIONS])
