"""Experiments as an operator sets them up, and counts of them when a test wants."""

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any

import httpx

from app.services import tallies
from app.services.rewards import Rewards
from app.services.tallies import Terms
from tests.app.guards import run
from tests.app.service import Service

EXPERIMENT = "/v1/admin/experiment"
AT_ONCE = Terms(lag=timedelta(0), settle=timedelta(seconds=-1))

MYOPIC: dict[str, Any] = {"name": "myopic", "params": {}}
RANDOM: dict[str, Any] = {"name": "random", "params": {}}


def arm(
    name: str, share: float, policy: dict[str, Any] | None = None
) -> dict[str, Any]:
    return {"name": name, "share": share, "policy": policy}


def begin(service: Service, *arms: dict[str, Any], **fields: object) -> dict[str, Any]:
    """Begin an experiment, or change it."""
    form = {"name": "trial", "arms": [*arms], **fields}
    return told(service.client.put(EXPERIMENT, json=form))


def report(service: Service, **query: int) -> dict[str, Any]:
    return told(service.client.get(EXPERIMENT, params=query))


def end(service: Service, note: str = "") -> dict[str, Any]:
    return told(service.client.delete(EXPERIMENT, params={"note": note}))


def told(answer: httpx.Response) -> dict[str, Any]:
    assert answer.is_success, answer.text
    body: dict[str, Any] = answer.json()
    return body


def arms_of(service: Service, users: Iterable[str]) -> dict[str, str | None]:
    """The arm in which each of these users is, by the record of the next play."""
    found = {}
    for user in users:
        play = service.next(user)["play"]
        found[user] = service.client.get(f"/v1/plays/{play}").json()["arm"]
    return found


def counted(
    service: Service, *, times: int = 1, terms: Terms = AT_ONCE
) -> dict[str, dict[str, Any]]:
    """Count all plays, in several processes at once if told so; the arms by name."""
    more = True
    while more:
        count = partial(
            tallies.count, now=datetime.now(UTC), terms=terms, rewards=Rewards()
        )
        more = any(run(service, *[count] * times))
    return {each["name"]: each for each in report(service)["arms"]}
