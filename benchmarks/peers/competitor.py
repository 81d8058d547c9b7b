"""What takes part: something that chooses an item and learns from the answer."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from benchmarks.peers.listeners import Luck

Session = Sequence[tuple[int, bool]]  # plays of one listener, and whether each is liked
SESSIONS, SESSION = 20, 50  # a log of a thousand plays


class Recommender(Protocol):
    def greet(self) -> None:
        """Begin with a listener of whom nothing is known."""

    def choose(self) -> int:
        """Return the item to play to the listener now."""

    def learn(self, item: int, *, liked: bool) -> None:
        """Take the listener's answer."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One listener of a catalogue, and what a log holds of others."""

    catalogue: int
    luck: Luck
    log: Sequence[Session]
    seed: int


@dataclass(frozen=True, slots=True)
class Competitor:
    """A recommender in one setting; `begin` makes it anew for each run.

    Of the settings of one name and one start, the best is shown.
    """

    name: str
    start: str
    setting: str
    begin: Callable[[Run], Recommender]
    encore: bool = False


def learners(
    name: str,
    settings: Mapping[str, Callable[[int], Recommender]],
    sessions: Sequence[int],
) -> list[Competitor]:
    """Enter a library in several settings, without a log and with parts of one.

    Args:
        name: of the library and its method.
        settings: each makes a recommender from a seed.
        sessions: how much of a log it may begin with.
    """
    return [
        Competitor(
            name,
            "a log" if count else "nothing",
            described(setting, count),
            taught(make, count),
        )
        for setting, make in settings.items()
        for count in (0, *sessions)
    ]


def described(setting: str, count: int) -> str:
    plays = f"{count * SESSION} plays" if count else ""
    return ", ".join(filter(None, [setting, plays]))


def taught(
    make: Callable[[int], Recommender], count: int
) -> Callable[[Run], Recommender]:
    def begin(run: Run) -> Recommender:
        recommender = make(run.seed)
        for session in run.log[:count]:
            recommender.greet()
            for item, liked in session:
                recommender.learn(item, liked=liked)
        return recommender

    return begin
