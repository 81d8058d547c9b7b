"""Lets shadows decide, one after the other, beside the requests and never before them.

What cannot be done soon is left out: it is a sample anyway.
"""

import asyncio
import random
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import structlog

from app import metrics
from app.domain import Shadow
from app.errors import ClientError
from app.logs import Seldom
from app.services import shade
from app.services.live import Live
from app.services.niceness import give_way
from app.services.rungs import Rung
from app.services.shade import Considered
from app.storage import revision, shadows
from app.storage.database import Database
from app.storage.shadows import ShadowTotal
from app.storage.store import Store

MOST = 64  # decisions that wait
EVERY = 5.0  # seconds after which what was found is stored

Job: TypeAlias = tuple[Considered, Shadow]

logger = structlog.get_logger()
told = Seldom(60.0)


class ShadowWatch:
    """Takes decisions to try on shadows, and stores now and then what came of it."""

    def __init__(self, database: Database, live: Live) -> None:
        self._database = database
        self._live = live
        self._thread = ThreadPoolExecutor(1, "shade", give_way)
        self._jobs: asyncio.Queue[Job | None] = asyncio.Queue(MOST)
        self._found: dict[tuple[int, str, int], ShadowTotal] = {}
        self._stored = time.monotonic()

    def consider(self, considered: Considered | None) -> None:
        """Draw which shadows are to decide this too, later."""
        if considered is None:
            return
        for shadow in considered.experiment.shadows:
            if random.random() < shadow.sample:  # noqa: S311 - a sample, no secret
                try:
                    self._jobs.put_nowait((considered, shadow))
                except asyncio.QueueFull:
                    metrics.shadow_misses(shadow.name, "skipped").inc()

    def stop(self) -> None:
        """Leave what waits; `run` ends soon."""
        while not self._jobs.empty():
            self._jobs.get_nowait()
        self._jobs.put_nowait(None)

    async def run(self) -> None:
        going = True
        while going:
            try:
                async with asyncio.timeout(EVERY):
                    job = await self._jobs.get()
            except TimeoutError:
                pass
            else:
                going = job is not None
                if job is not None:
                    await self._try(*job)
            if not going or time.monotonic() - self._stored >= EVERY:
                await self._store()
        self._thread.shutdown(wait=False)

    async def _try(self, considered: Considered, shadow: Shadow) -> None:
        """Let a shadow decide; that it cannot is told, and concerns nobody else."""
        try:
            prepare = partial(self._prepared, shadow=shadow, considered=considered)
            rung = await self._database.run(prepare)
            work = partial(shade.compared, considered, shadow.name, rung)
            loop = asyncio.get_running_loop()
            self._take(await loop.run_in_executor(self._thread, work), considered)
        except Exception:
            metrics.shadow_misses(shadow.name, "failed").inc()
            held = told.take((shadow.name, shadow.policy))
            if held is not None:
                logger.exception(
                    "a shadow does not decide",
                    shadow=shadow.name,
                    version=shadow.policy,
                    held_back=held,
                )

    def _prepared(self, store: Store, shadow: Shadow, considered: Considered) -> Rung:
        known = revision.current(store)
        catalogue = considered.catalogue
        return self._live.policy(store, known, catalogue, shadow.policy).rungs[0]

    def _take(self, found: ShadowTotal, considered: Considered) -> None:
        key = found.experiment, found.shadow, found.part
        before = self._found.get(key)
        self._found[key] = found if before is None else _together(before, found)
        metrics.shadow_decisions(found.shadow, "yes" if found.agreed else "no").inc()
        like = considered.served.predicted
        metrics.shadow_likes(found.shadow, "served").inc(like)
        metrics.shadow_likes(found.shadow, "shadow").inc(max(like + found.gained, 0.0))

    async def _store(self) -> None:
        """Add what was found to what is known; what fails is tried again."""
        self._stored = time.monotonic()
        found, self._found = self._found, {}
        try:
            await self._database.run(partial(shadows.add, totals=found.values()))
        except ClientError as error:
            logger.warning("shadows are counted late", reason=error.detail)
            self._found = found
        except Exception:  # it would fail again
            logger.exception("decisions of shadows are lost")


def _together(before: ShadowTotal, found: ShadowTotal) -> ShadowTotal:
    return replace(
        before,
        decisions=before.decisions + found.decisions,
        agreed=before.agreed + found.agreed,
        gained=before.gained + found.gained,
    )
