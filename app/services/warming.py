"""Compiles the decision code ahead of the first request."""

import asyncio
import threading
from collections.abc import Sequence
from contextlib import suppress

from app.errors import NotReady
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
    """Wait for the compiler, in a thread that the end of the service does not await."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[None] = loop.create_future()

    def settle(error: Exception | None) -> None:
        if done.cancelled():
            return
        if error is None:
            done.set_result(None)
        else:
            done.set_exception(error)

    def work() -> None:
        failed: Exception | None = None
        try:
            warm_up(policies)
        except Exception as error:  # noqa: BLE001 - it is raised where it is awaited
            failed = error
        with suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(settle, failed)

    threading.Thread(target=work, name="compiler", daemon=True).start()
    await done
