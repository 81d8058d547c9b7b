"""What Prometheus reads."""

import asyncio
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from fastapi import APIRouter, Request
from fastapi.responses import PlainTextResponse
from prometheus_client import REGISTRY, CollectorRegistry, Metric, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from prometheus_client.multiprocess import MultiProcessCollector
from prometheus_client.registry import Collector

from app import workers
from app.api.context import context_of

router = APIRouter(tags=["operations"])


class Together(Collector):
    """What all processes that serve together have counted."""

    def __init__(self, shared: Path) -> None:
        self._shared = shared

    def collect(self) -> Iterable[Metric]:
        files = workers.files(self._shared)
        merged: Iterable[Metric] = MultiProcessCollector.merge(files)  # type: ignore[no-untyped-call]
        return merged


@router.get("/metrics", response_class=PlainTextResponse)
async def metrics(request: Request) -> PlainTextResponse:
    """Show the counts of this process, or of all processes that serve together."""
    await context_of(request).pending.refresh()
    write = partial(generate_latest, _registry())
    text = await asyncio.to_thread(write)  # files of many processes take a while
    return PlainTextResponse(text, media_type=CONTENT_TYPE_PLAIN_0_0_4)


def _registry() -> CollectorRegistry:
    shared = workers.directory()
    if shared is None:
        return REGISTRY
    registry = CollectorRegistry()
    registry.register(Together(shared))
    return registry
