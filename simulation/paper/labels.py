"""The policies that are tried, by the names that tables and figures have for them."""

from collections.abc import Mapping
from types import MappingProxyType

from simulation.paper.rows import Entry

MYOPIC, WHITTLE, WHITTLE_MC = "myopic", "Whittle", "Whittle, Monte Carlo"
PAPER, EXPECTED = "MC rollout, as in the paper", "MC rollout, expected rewards"
EXACT, SHIPPED = "exact rollout, myopic base", "exact rollout, as shipped"
RANDOM_BASE = "MC rollout, random base"
FIXED, RANDOM, ROUND_ROBIN = "best fixed item", "random", "round robin"
PARAMS: Mapping[str, tuple[str, Mapping[str, object]]] = MappingProxyType(
    {
        MYOPIC: ("myopic", {}),
        WHITTLE: ("whittle", {}),
        WHITTLE_MC: ("whittle_mc", {}),
        PAPER: ("rollout", {"preset": "paper"}),
        EXPECTED: ("rollout", {}),
        RANDOM_BASE: ("rollout", {"preset": "paper", "base": "random"}),
        EXACT: ("exact_rollout", {"base": "myopic", "horizon": 5, "leaf": "none"}),
        SHIPPED: ("exact_rollout", {}),
        FIXED: ("best_fixed", {}),
        RANDOM: ("random", {}),
        ROUND_ROBIN: ("round_robin", {}),
    }
)


def entry(label: str, runs: int, **params: object) -> Entry:
    """Return a policy by its label, with some parameters changed."""
    name, usual = PARAMS[label]
    return Entry(label, name, {**usual, **params}, runs)
