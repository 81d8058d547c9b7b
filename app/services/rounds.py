"""What is done in the background again and again, until the service stops."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

import structlog

from app.errors import ClientError

logger = structlog.get_logger()


class Rounds:
    """Has its turn every so many seconds. What fails is told, and tried again."""

    def __init__(
        self, turn: Callable[[], Awaitable[None]], every: float, delayed: str
    ) -> None:
        self._turn = turn
        self._every = every
        self._delayed = delayed  # what is told of a failure
        self._stopping = asyncio.Event()

    @property
    def is_stopping(self) -> bool:
        return self._stopping.is_set()

    def stop(self) -> None:
        """Do not begin another turn; `run` ends soon."""
        self._stopping.set()

    async def run(self) -> None:
        while not self.is_stopping:
            try:
                await self._turn()
            except ClientError as error:
                logger.warning(self._delayed, reason=error.detail)
            except Exception:  # whatever it is, serving goes on
                logger.exception(self._delayed)
            with suppress(TimeoutError):
                await asyncio.wait_for(self._stopping.wait(), self._every)
