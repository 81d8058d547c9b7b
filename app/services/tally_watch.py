"""Counts the plays of experiments now and then, beside the requests."""

from datetime import UTC, datetime, timedelta
from functools import partial

from app.services import tallies
from app.services.rewards import Rewards
from app.services.rounds import Rounds
from app.services.tallies import Terms
from app.storage.database import Database

EVERY = 15.0  # seconds between counts, of whatever process


class TallyWatch:
    """Counts if no other process just did, as long as there is something to count."""

    def __init__(self, database: Database, lag: timedelta) -> None:
        self._database = database
        self._terms = Terms(lag)
        self._rewards = Rewards()
        self._rounds = Rounds(self._turn, EVERY, "experiments are counted late")
        self.stop = self._rounds.stop
        self.run = self._rounds.run

    async def _turn(self) -> None:
        due = partial(
            tallies.is_due,
            now=datetime.now(UTC),
            every=timedelta(seconds=0.9 * EVERY),
            terms=self._terms,
        )
        more = await self._database.run(due)
        while more and not self._rounds.is_stopping:
            count = partial(
                tallies.count,
                now=datetime.now(UTC),
                terms=self._terms,
                rewards=self._rewards,
            )
            more = await self._database.run(count)
