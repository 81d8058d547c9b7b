"""How the process itself is, measured each second rather than at each request."""

import asyncio
import os
import time
from collections.abc import Mapping

from prometheus_client import ProcessCollector

from app import __version__, metrics
from app.storage.database import Database

PERIOD = 1.0  # seconds


class Vitals:
    """Keeps the gauges of a process that serves, until it is cancelled."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._process = ProcessCollector(registry=None)
        self._cpu = 0.0
        self._due = time.monotonic()

    async def run(self) -> None:
        metrics.WORKERS.set(1)
        metrics.BUILD.labels(__version__).set(1)
        while True:
            self._look()
            self._due = time.monotonic() + PERIOD
            await asyncio.sleep(PERIOD)
            metrics.LAG.observe(max(0.0, time.monotonic() - self._due))

    def _look(self) -> None:
        self._look_at_the_database()
        cpu = sum(os.times()[:2])
        metrics.CPU.inc(cpu - self._cpu)
        self._cpu = cpu
        found = self._of_the_system()
        if found:  # only Linux tells
            metrics.STARTED.set(found["process_start_time_seconds"])
            metrics.MEMORY.set(found["process_resident_memory_bytes"])
            share = found["process_open_fds"] / found["process_max_fds"]
            metrics.OPEN_FILES.set(share)

    def _look_at_the_database(self) -> None:
        load = self._database.load()
        metrics.QUEUED.set(load.queued)
        metrics.QUEUE_LIMIT.set(load.limit)
        for pool, (used, most) in load.connections.items():
            metrics.CONNECTIONS.labels(pool).set(used)
            metrics.CONNECTION_LIMIT.labels(pool).set(most)

    def _of_the_system(self) -> Mapping[str, float]:
        return {
            sample.name: sample.value
            for family in self._process.collect()
            for sample in family.samples
        }
