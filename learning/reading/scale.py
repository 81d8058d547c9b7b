"""What answers there are, and what a share played means."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from policies import NO_ANSWER

SKIP, LIKE = "skip", "like"
LIKE_FRACTION = 0.8


def _of_likes() -> Mapping[str, float]:
    return {SKIP: 0.0, LIKE: LIKE_FRACTION}


@dataclass(frozen=True, slots=True)
class Scale:
    """The signals of a log.

    Attributes:
        signals: K names, none of them "none".
        reward: (K,) in [0, 1], worth of each.
        fractions: the least share played that means a signal, by its name: the highest
            that was reached counts. One of them is 0. None: a share means none of them.
    """

    signals: Sequence[str] = (SKIP, LIKE)
    reward: tuple[float, ...] = (0.0, 1.0)
    fractions: Mapping[str, float] | None = field(default_factory=_of_likes)

    def __post_init__(self) -> None:
        """Check."""
        if len(set(self.signals) - {NO_ANSWER}) != len(self.reward):
            raise ValueError("signals must be distinct, with a reward each")
        if self.fractions is not None:
            shares = sorted(self.fractions.values())
            if not self.fractions.keys() <= set(self.signals):
                raise ValueError("fractions must name signals")
            if shares[:1] != [0.0] or len(set(shares)) < len(shares):
                raise ValueError("fractions must be distinct, and one of them 0")

    @property
    def is_of_likes(self) -> bool:
        """Whether the signals are a skip and a like."""
        return set(self.signals) == {SKIP, LIKE}
