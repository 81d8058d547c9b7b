"""Builds full index tables in the background, one at a time in each process."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from uuid import uuid4

import structlog

from app.domain import Revision
from app.errors import ClientError
from app.metrics import INDEX_BUILDS, INDEX_TABLES_WAITING
from app.services import index_builds, index_tables
from app.services.index_builds import Job
from app.services.index_tables import Built
from app.services.niceness import give_way
from app.storage import revision
from app.storage.database import Database
from app.storage.index_builds import Target

POLL = 5.0  # seconds after which changes by other processes are looked for
RENEW = 1.0  # seconds after which a claim is renewed, and the progress is told
GATHER = 5.0  # seconds for which tables are gathered: each publication costs a little
LONGEST_PAUSE = 300.0  # seconds, after failures in a row

logger = structlog.get_logger()


class Stopped(Exception):
    """The build is given up, because the service stops."""


class IndexBuilder:
    """Finds tables that are wanted, builds and publishes them, until it is stopped."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._worker = uuid4().hex
        self._thread = ThreadPoolExecutor(1, "index", give_way)
        self._woken = asyncio.Event()
        self._stopping = False
        self._held: list[Built] = []
        self._held_since = 0.0
        self._failed: set[Target] = set()
        self._complete_in: Revision | None = None

    def wake(self) -> None:
        """Look at once: this process has changed a model or the policy."""
        self._failed.clear()
        self._woken.set()

    def stop(self) -> None:
        """Give up what is being built; `run` ends soon."""
        self._stopping = True
        self._woken.set()

    async def run(self) -> None:
        failures = 0
        while not self._stopping:
            try:
                pause = await self._turn()
                failures = 0
            except Stopped:
                break
            except Exception as error:  # noqa: BLE001 - whatever it is, serving goes on
                _tell(error)
                failures += 1
                pause = min(POLL * 2**failures, LONGEST_PAUSE)
            await self._rest(pause)
        await self._leave()

    async def _turn(self) -> float:
        """Build a table if one is wanted; tell how many seconds to rest then."""
        if await self._database.run(revision.current) == self._complete_in:
            return POLL
        look = await self._database.run(
            partial(
                index_builds.claim,
                worker=self._worker,
                held=[*map(index_builds.target_of, self._held)],
                but=self._failed,
            )
        )
        INDEX_TABLES_WAITING.set(look.waiting)
        if look.waiting == 0:
            self._complete_in = look.known
        if look.job is None:
            return 0.0 if await self._publish() else POLL
        await self._build(look.job)
        if time.monotonic() - self._held_since >= GATHER:
            await self._publish()
        return 0.0

    async def _build(self, job: Job) -> None:
        """Build a table in the thread, and renew the claims meanwhile."""
        ours = partial(index_builds.is_ours, worker=self._worker, target=job.target)
        if not await self._database.run(ours):
            return
        done = 0.0

        def progress(share: float) -> None:
            nonlocal done
            done = share
            if self._stopping:
                raise Stopped

        wanted = job.target.sample, job.target.discount
        full = partial(index_tables.full, job.model, *wanted, progress)
        building = asyncio.get_running_loop().run_in_executor(self._thread, full)
        while not (await asyncio.wait((building,), timeout=RENEW))[0]:
            await self._renew(job.target, done)
        try:
            built = await building
        except Stopped:
            raise
        except Exception:
            logger.exception("an index table cannot be built", model=job.model.id)
            self._failed.add(job.target)
            return
        INDEX_BUILDS.observe(built.record.seconds)
        if not self._held:
            self._held_since = time.monotonic()
        self._held.append(built)

    async def _renew(self, target: Target, done: float) -> None:
        targets = dict.fromkeys(map(index_builds.target_of, self._held), 1.0)
        renew = partial(
            index_builds.renew, worker=self._worker, targets=targets | {target: done}
        )
        with suppress(ClientError):  # the next one may succeed before it lapses
            await self._database.run(renew)

    async def _publish(self) -> bool:
        """Store what was built; tell whether there was anything."""
        if not self._held:
            return False
        publish = partial(index_builds.publish, built=self._held)
        await self._database.run_in_turn(publish)
        logger.info("index tables", models=[built.record.model for built in self._held])
        self._held = []
        return True

    async def _rest(self, seconds: float) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._woken.wait(), seconds)
        self._woken.clear()

    async def _leave(self) -> None:
        """Publish what is built, leave what is not to others."""
        release = partial(index_builds.release, worker=self._worker)
        try:
            await self._publish()
            await self._database.run(release)
        except Exception as error:  # noqa: BLE001 - others take over when claims lapse
            _tell(error)
        self._thread.shutdown(wait=False)


def _tell(error: Exception) -> None:
    if isinstance(error, ClientError):
        logger.warning("index tables are delayed", reason=error.detail)
    else:
        logger.error("index tables are delayed", exc_info=error)
