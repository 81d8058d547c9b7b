"""How a log is asked."""

from dataclasses import dataclass

FEWEST = 2  # users that tell how much users differ


@dataclass(frozen=True, slots=True)
class Rules:
    """How a log is asked.

    Attributes:
        in_a_row: up to how many choices in a row of the policy are asked for.
        clip: at which weights are cut off: they vary less, and are biased; None: not.
        least_plays: answered, below which nothing is said.
        least_users: who gave answers, below which nothing is said.
        least_effective: plays of the policy that answers must be worth.
        draws: of users, for intervals.
        seed: of these, and of what the policy draws.
    """

    in_a_row: int = 1
    clip: float | None = None
    least_plays: int = 100
    least_users: int = 30
    least_effective: float = 100.0
    draws: int = 1000
    seed: int = 0

    def __post_init__(self) -> None:
        """Check.

        Raises:
            ValueError: names the field.
        """
        if self.in_a_row < 1 or self.draws < 1:
            raise ValueError("in_a_row, draws: must be at least 1")
        if self.clip is not None and not self.clip > 0:
            raise ValueError("clip: must be above 0")
        if self.least_plays < 1 or self.least_users < FEWEST:
            raise ValueError("least_plays, least_users: must be at least 1 and 2")


RULES = Rules()
