"""How things went lately: plays and likes by policy and time, of the latest plays."""

import asyncio
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import partial
from uuid import UUID

from app.domain import PolicyVersion
from app.play_ids import moment, since
from app.services.in_force import find_policy
from app.services.rewards import Rewards
from app.storage import recent
from app.storage.database import Database
from app.storage.recent import PlayRow
from app.storage.store import Store
from learning import sequential
from learning.sequential import Estimate, Sums

MOST = 20_000  # plays that are looked at
PAGE = 1_000  # of them, between which requests have their turn
FRESH = 4.0  # seconds for which a look is good
LATEST = UUID(int=2**128 - 1)


@dataclass(slots=True)
class Bucket:
    """Plays of a policy that were chosen within a span of time.

    answered: those with an answer that has a reward
    likes:    their rewards
    expected: rewards that were predicted for them
    """

    plays: int = 0
    answered: int = 0
    likes: float = 0.0
    expected: float = 0.0


@dataclass(slots=True)
class Course:
    """What the plays of one policy came to, in all and by number of the bucket."""

    total: Bucket = field(default_factory=Bucket)
    buckets: dict[int, Bucket] = field(default_factory=lambda: defaultdict(Bucket))
    users: dict[str, Bucket] = field(default_factory=lambda: defaultdict(Bucket))

    def take(self, play: PlayRow, number: int, reward: float | None) -> None:
        for bucket in (self.total, self.buckets[number], self.users[play.user]):
            bucket.plays += 1
            if reward is not None:
                bucket.answered += 1
                bucket.likes += reward
                bucket.expected += play.predicted

    @property
    def rate(self) -> Estimate | None:
        """The like rate; the plays of one user count as one cluster."""
        sums = Sums()
        for user in self.users.values():
            sums += sequential.of_user(user.answered, user.likes)
        return sequential.rate(sums)


@dataclass(frozen=True, slots=True, eq=False)
class Overview:
    """The latest plays.

    since:    plays chosen from then on were looked at
    until:    and before
    span:     that was asked for; buckets divide it
    bucket:   length of one of them
    courses:  by version of the policy; None: plays that users chose alone
    policies: those versions
    """

    since: datetime
    until: datetime
    span: timedelta
    bucket: timedelta
    courses: Mapping[int | None, Course]
    policies: Mapping[int, PolicyVersion]


class Overviews:
    """Looks, each of which is good for all who ask for the same a moment later."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._alone = asyncio.Lock()
        self._known: dict[tuple[timedelta, int], tuple[float, Overview]] = {}

    async def look(self, span: timedelta, buckets: int) -> Overview:
        """Look at a span of time, or tell what was seen a moment ago."""
        key = span, buckets
        async with self._alone:
            now = time.monotonic()
            fresh = {
                known: look for known, look in self._known.items() if look[0] > now
            }
            if key not in fresh:
                read = partial(
                    overview, now=datetime.now(UTC), span=span, buckets=buckets
                )
                fresh[key] = now + FRESH, await self._database.run(read)
            self._known = fresh
            return fresh[key][1]


def overview(store: Store, now: datetime, span: timedelta, buckets: int) -> Overview:
    """Look at the plays of a span of time, or as many of them as is quick."""
    begin, before = now - span, LATEST
    courses: dict[int | None, Course] = defaultdict(Course)
    rewards = Rewards()
    for _ in range(MOST // PAGE):
        page = recent.plays_before(store, before, since(begin), PAGE)
        for play in page:
            number = int((play.created_at - begin) / span * buckets)
            number = min(max(number, 0), buckets - 1)
            reward = rewards.of(store, play.model, play.version, play.signal)
            courses[play.policy].take(play, number, reward)
        if len(page) < PAGE:
            break
        before = page[-1].id
        store.pause()
    else:
        begin = moment(before)
    known = {version: find_policy(store, version) for version in _versions([*courses])}
    return Overview(begin, now, span, span / buckets, courses, known)


def _versions(courses: Sequence[int | None]) -> Sequence[int]:
    return sorted(version for version in courses if version is not None)
