"""Compiles the decision code ahead of the first request."""

import asyncio
from collections.abc import Sequence
from functools import partial

from app.errors import NotReady
from app.services.beside import beside
from app.services.live import find_policy
from app.services.policy_catalogue import made
from app.storage import revision
from app.storage.store import Store
from policies import Policy, variants, warm_up

__all__ = ["compiled", "in_force", "variants", "warm_up"]


def in_force(store: Store) -> list[Policy]:
    """The policy in force; none if this release does not know it."""
    try:
        return [made(find_policy(store, revision.current(store).policy))]
    except NotReady:
        return []


async def compiled(policies: Sequence[Policy]) -> None:
    """Wait for the compiler, which the end of the service does not await."""
    await asyncio.wrap_future(beside(partial(warm_up, policies)))
