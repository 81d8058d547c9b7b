"""What plays add to their users, and to the arms that these met first."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import NamedTuple, TypeAlias

from app.storage.tallies import ArmTotal, ArmUser
from learning.sequential import Sums, of_user

Arm: TypeAlias = tuple[int, str]  # the version with which its experiment began; a name


class Taken(NamedTuple):
    """A play of an arm. `reward`: None: it was not answered."""

    user: str
    arm: Arm
    reward: float | None


@dataclass(slots=True)
class Added:
    """What a number of plays, in order, make of users.

    before: what is known of them
    users:  what becomes of them, by name and experiment
    met:    users of each arm who were not known before
    plays:  that count, by arm
    moved:  those that do not: their user has met another arm of the experiment before
    """

    before: Mapping[tuple[str, int], ArmUser]
    users: dict[tuple[str, int], ArmUser] = field(default_factory=dict)
    met: Counter[Arm] = field(default_factory=Counter)
    plays: Counter[Arm] = field(default_factory=Counter)
    moved: Counter[Arm] = field(default_factory=Counter)

    @classmethod
    def of(cls, plays: Iterable[Taken], known: Iterable[ArmUser]) -> "Added":
        """Take plays in, but for late ones of users who are in a later experiment."""
        added = cls({(user.user_id, user.experiment): user for user in known})
        present = dict(added.before.keys())
        for play in plays:
            if play.arm[0] >= present.get(play.user, 0):
                added.take(play)
        return added

    def take(self, play: Taken) -> None:
        """Take a play in."""
        origin, arm = play.arm
        key = play.user, origin
        user = self.users.get(key) or self.before.get(key)
        if user is None:
            user = ArmUser(play.user, origin, arm)
            self.met[play.arm] += 1
        if user.arm != arm:
            self.moved[play.arm] += 1
            return
        self.plays[play.arm] += 1
        user = replace(user, plays=user.plays + 1)
        if play.reward is not None:
            earned = user.earned + play.reward
            user = replace(user, answered=user.answered + 1, earned=earned)
        self.users[key] = user

    @property
    def latest(self) -> Collection[ArmUser]:
        """Each user in the experiment that was met last."""
        ordered = sorted(self.users.values(), key=lambda user: user.experiment)
        return {user.user_id: user for user in ordered}.values()

    @property
    def arms(self) -> Collection[Arm]:
        """Those that something is added to."""
        return self.plays.keys() | self.moved.keys()

    def grown(self, total: ArmTotal) -> ArmTotal:
        """What an arm adds up to now."""
        arm = total.experiment, total.arm
        sums = Sums(**total.sums)
        for key, user in self.users.items():
            if (user.experiment, user.arm) == arm:
                sums += of_user(user.answered, user.earned)
                known = self.before.get(key)
                if known is not None:
                    sums += -of_user(known.answered, known.earned)
        return replace(
            total,
            users=total.users + self.met[arm],
            plays=total.plays + self.plays[arm],
            moved=total.moved + self.moved[arm],
            sums=asdict(sums),
        )


def none_yet(arm: Arm) -> ArmTotal:
    """An arm before its first play."""
    return ArmTotal(*arm, users=0, plays=0, moved=0, sums={})
