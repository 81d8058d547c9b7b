"""Makes all ready that the first request would have to wait for."""

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from functools import cache, partial

import structlog

from app.errors import NotReady
from app.services.beside import beside
from app.services.in_force import find_policy, versions
from app.services.live import Live
from app.services.rungs import policies_of
from app.storage import experiments, revision
from app.storage.store import Store
from policies import Policy, variants, warm_up

__all__ = ["compiled", "in_force", "load", "variants", "warm_up"]

logger = structlog.get_logger()


def in_force(store: Store) -> list[Policy]:
    """What may have to decide now, the policy for all first; none that is unknown."""
    known = revision.current(store)
    found: list[Policy] = []
    for version in versions(known, experiments.by_version(store, known.experiment)):
        with suppress(NotReady):
            found += policies_of(find_policy(store, version))
    return list(dict.fromkeys(found))


def load(store: Store, live: Live) -> None:
    """Read the catalogue, and make the policy in force ready for its models.

    A policy that this release does not know, and an empty catalogue, are left alone.
    """
    known = revision.current(store)
    catalogue = live.catalogue(store, known)
    if catalogue.versions:
        with suppress(NotReady):
            live.policy(store, known, catalogue)


@cache
def _compile(policy: Policy) -> None:
    """Once in a process."""
    warm_up([policy])


async def compiled(policies: Iterable[Policy]) -> None:
    """Wait for the compiler, which the end of the service does not await.

    What cannot be compiled now is told, and compiled by the first that needs it.
    """
    for one in policies:
        try:
            await asyncio.wrap_future(beside(partial(_compile, one)))
        except Exception:
            logger.exception("compiling_failed", policy=type(one).__name__)
