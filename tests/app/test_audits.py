"""Beliefs are a cache of the log: damage is found, and mended."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from datetime import timedelta
from functools import partial
from typing import Any, TypeVar

import numpy as np
import pytest
import sqlalchemy as sa

from app.errors import UserNotFound
from app.services import audits
from app.services import beliefs as beliefs_service
from app.services.audits import Audited
from app.services.live import Live
from app.storage import users as users_storage
from app.storage.database import Database
from app.storage.packing import Entries, pack, unpack
from app.storage.store import Store
from app.storage.tables import beliefs, plays, users
from tests.app.service import Service
from tests.catalogues import SERIES, SIMPLE

T = TypeVar("T")

MOODY: dict[str, Any] = {
    **{name: SIMPLE[name] for name in ("states", "play", "rest", "prior")},
    "mood": {
        "answers": 1,
        "memory": None,
        "levels": [],
        "pause_s": None,
        "like": [[0.2, 0.8]] * 3,
    },
}

PACKED = sa.select(beliefs.c.packed).where(beliefs.c.user_id == "ann")
SET_PACKED = beliefs.update().where(beliefs.c.user_id == "ann")
SET_USER = users.update().where(users.c.id == "ann")


def test_an_intact_database_has_no_findings(listened: Service) -> None:
    audited = audit(listened)

    assert [(one.user, one.plays, one.findings) for one in audited] == [
        ("ann", 12, []),
        ("bob", 12, []),
    ]


@pytest.mark.parametrize(
    ("damage", "problem"),
    [
        (lambda e: Entries(e.serial, e.slot, e.belief + 1e-6), "is off by"),
        (lambda e: Entries(e.serial, e.slot - 1, e.belief), "of slot"),
        (lambda e: Entries(e.serial, e.slot, e.belief * np.nan), "is off by"),
        (
            lambda e: Entries(e.serial[1:], e.slot[1:], e.belief[1:]),
            "of other items",
        ),
    ],
    ids=["belief", "slot", "nan", "missing"],
)
def test_corrupt_beliefs_are_found_and_mended(
    listened: Service, damage: Callable[[Entries], Entries], problem: str
) -> None:
    sound = listened.beliefs("ann")
    corrupt(listened, lambda packed: pack(damage(unpack(packed, 4))))

    [found, clean] = audit(listened)

    assert problem in found.findings[0].problem
    assert clean.findings == []
    rebuild(listened)
    assert [one.findings for one in audit(listened)] == [[], []]
    assert listened.beliefs("ann") == sound


def test_a_corrupt_mood_is_found_and_mended(listened: Service) -> None:
    listened.put_model("moody", MOODY)
    rebuild(listened)
    sound = listened.beliefs("ann")

    def damaged(packed: bytes) -> bytes:
        kept = unpack(packed, 4)
        assert kept.felt is not None
        return pack(replace(kept, felt=replace(kept.felt, tendency=0.123)))

    corrupt(listened, damaged)

    [found, clean] = audit(listened)

    assert "mood" in found.findings[0].problem
    assert clean.findings == []
    rebuild(listened)
    assert audit(listened)[0].findings == []
    assert listened.beliefs("ann") == sound


def test_beliefs_cut_short_are_found_and_mended(listened: Service) -> None:
    corrupt(listened, lambda packed: packed[:-3])

    [found, _] = audit(listened)

    assert "cannot be read" in found.findings[0].problem
    rebuild(listened, "ann")
    assert audit(listened)[0].findings == []


def test_signals_that_models_lost_are_no_fault(listened: Service) -> None:
    for model in ("item-1", "item-2", "item-3", "item-4", "item-5"):
        listened.put_model(model, SERIES)
    for item in ("item-1", "item-2"):
        report = {"item": item, "signal": "partial"}
        listened.client.post("/v1/users/ann/plays", json=report).raise_for_status()
    several = audit(listened)
    listened.put_model("item-1", SIMPLE)
    due = audit(listened)
    report = {"item": "item-1", "signal": "like"}
    listened.client.post("/v1/users/ann/plays", json=report).raise_for_status()
    carried_on = listened.beliefs("ann")

    assert [(one.stale, one.findings) for one in several] == [(False, []), (True, [])]
    assert [(one.stale, one.findings) for one in due] == [(True, [])] * 2
    assert [one.findings for one in audit(listened)] == [[], []]
    rebuild(listened)
    assert [(one.stale, one.findings) for one in audit(listened)] == [(False, [])] * 2
    assert listened.beliefs("ann") == carried_on


def test_what_was_forgotten_is_forgotten_by_a_rebuild_too(service: Service) -> None:
    """An answer that was hardly possible makes much of what was next to nothing."""
    slow = {
        "states": ["low", "high"],
        "play": [[0.9, 0.1], [0.1, 0.9]],
        "rest": [[1.0, 0.0], [0.1, 0.9]],
        "like": [1e-6, 1.0],
        "prior": [1.0, 0.0],
    }
    service.put_model("slow", slow)
    service.put_item("one", "slow")
    service.put_item("other", "slow")
    for item, signal in [("one", "none"), *[("other", "none")] * 275, ("one", "like")]:
        service.client.post(
            "/v1/users/ann/plays", json={"item": item, "signal": signal}
        ).raise_for_status()

    before = service.beliefs("ann")

    assert [one.findings for one in audit(service)] == [[]]
    rebuild(service)
    assert service.beliefs("ann") == before


def test_beliefs_rebuilt_for_a_slot_know_of_nothing_later(listened: Service) -> None:
    """Another request may close a play between two reads of this one."""

    def rebuilt_for_slot_7(store: Store, live: Live) -> int:
        revision, user = users_storage.by_id(store, "ann")
        catalogue = live.catalogue(store, revision)
        earlier = replace(user, slot=7, epoch=-1)
        return int(beliefs_service.kept(store, catalogue, earlier).slot.max())

    async def run(database: Database, live: Live) -> int:
        return await database.run(partial(rebuilt_for_slot_7, live=live))

    assert with_database(listened, run) == 7


def test_nothing_is_rebuilt_of_a_user_never_seen(listened: Service) -> None:
    with pytest.raises(UserNotFound):
        rebuild(listened, "nobody")

    assert [one.user for one in audit(listened)] == ["ann", "bob"]


def test_a_wrong_slot_and_a_lost_pending_play_are_found_and_mended(
    listened: Service,
) -> None:
    pending = listened.next("ann")
    write(listened, SET_USER.values(slot=3, pending=None))

    problems = [finding.problem for finding in audit(listened)[0].findings]

    assert any("its slot is 3" in problem for problem in problems)
    assert any("pending play is None" in problem for problem in problems)
    rebuild(listened)
    assert audit(listened)[0].findings == []
    assert listened.next("ann")["play"] == pending["play"]


def test_a_wrong_slot_of_a_slate_is_found_and_mended(listened: Service) -> None:
    slate = listened.next("ann", count=3)["plays"]
    listened.answer(slate[1]["play"], "like")
    write(listened, SET_USER.values(pending_slot=7))

    [finding] = audit(listened)[0].findings

    assert "the slot of its pending plays is 7, not 12" in finding.problem
    rebuild(listened)
    assert listened.answer(slate[0]["play"], "like")["slot"] == 13
    assert audit(listened)[0].findings == []


def test_a_slot_shared_by_plays_not_chosen_together_is_found(listened: Service) -> None:
    moved = plays.update().where(plays.c.user_id == "ann", plays.c.closed == 11)
    write(listened, moved.values(closed=10, place=1))

    problems = [finding.problem for finding in audit(listened)[0].findings]

    assert "its slot 10 is shared by plays not chosen together" in problems


@pytest.fixture
def listened(example: Service) -> Service:
    """Two users who have been played a dozen items each."""
    example.set_policy("random")
    for user in ("ann", "bob"):
        for signal in ("like", "skip", "none") * 4:
            example.answer(example.next(user)["play"], signal)
    return example


def audit(service: Service) -> list[Audited]:
    async def run(database: Database, live: Live) -> list[Audited]:
        return [audited async for audited in audits.audit(database, live)]

    return with_database(service, run)


def rebuild(service: Service, user: str | None = None) -> list[str]:
    async def run(database: Database, live: Live) -> list[str]:
        return [rebuilt async for rebuilt in audits.rebuild(database, live, user)]

    return with_database(service, run)


def corrupt(service: Service, damage: Callable[[bytes], bytes]) -> None:
    async def run(database: Database, _: Live) -> None:
        row = await database.run(lambda store: store.row(PACKED))
        assert row is not None
        damaged = SET_PACKED.values(packed=damage(row.packed))
        await database.run(lambda store: store.write(damaged, {}))

    with_database(service, run)


def write(service: Service, statement: sa.Executable) -> None:
    async def run(database: Database, _: Live) -> None:
        await database.run(lambda store: store.write(statement, {}))

    with_database(service, run)


def with_database(
    service: Service, work: Callable[[Database, Live], Awaitable[T]]
) -> T:
    async def run() -> T:
        database = Database(service.settings)
        try:
            return await work(database, Live(timedelta(minutes=30)))
        finally:
            await database.close()

    return asyncio.run(run())
