"""How many plays wait for their answer, counted now and then."""

import asyncio
import math
import time

from app.errors import ClientError
from app.metrics import PENDING
from app.storage import plays
from app.storage.database import Database

FRESH = 15.0  # seconds for which a count is good
PATIENCE = 1.0  # seconds that a caller waits for a new one


class PendingPlays:
    """Keeps the gauge, without ever holding up or failing those who read it."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._counted = -math.inf
        self._counting: asyncio.Task[None] | None = None

    async def refresh(self) -> None:
        """Count again if the last count is old."""
        if time.monotonic() - self._counted >= FRESH:
            self._counted = time.monotonic()
            self._counting = asyncio.create_task(self._count())
        if self._counting is not None:
            await asyncio.wait((self._counting,), timeout=PATIENCE)

    async def _count(self) -> None:
        try:
            PENDING.set(await self._database.run(plays.count_pending))
        except ClientError:
            return  # the last count stays
