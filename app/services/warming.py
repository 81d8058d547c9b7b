"""Compiles the decision code ahead of the first request."""

from app.errors import NotReady
from app.services.live import find_policy
from app.services.policy_catalogue import made
from app.storage import revision
from app.storage.store import Store
from policies import Policy, variants, warm_up

__all__ = ["in_force", "variants", "warm_up"]


def in_force(store: Store) -> list[Policy]:
    """The policy in force; none if this release does not know it."""
    try:
        return [made(find_policy(store, revision.current(store).policy))]
    except NotReady:
        return []
