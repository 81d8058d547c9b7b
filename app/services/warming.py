"""Compiles the decision code ahead of the first request."""

import asyncio
import threading
from collections.abc import Sequence
from concurrent.futures import Future

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
    done: Future[None] = Future()

    def work() -> None:
        try:
            warm_up(policies)
        except Exception as error:  # noqa: BLE001 - it is raised where it is awaited
            done.set_exception(error)
        else:
            done.set_result(None)

    done.set_running_or_notify_cancel()
    threading.Thread(target=work, name="compiler", daemon=True).start()
    await asyncio.wrap_future(done)
