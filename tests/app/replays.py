"""Decisions, taken again."""

import asyncio
from datetime import timedelta
from functools import partial
from uuid import UUID

from app.services.live import Live
from app.services.replays import replay
from app.storage import plays
from app.storage.database import Database
from app.storage.store import Store
from tests.app.service import Service

Outcome = tuple[str, float, float]


def taken_again(service: Service, ids: list[str]) -> list[tuple[str, Outcome]]:
    """Replay plays in a process that starts from nothing but the database."""

    def outcome(store: Store, live: Live, play_id: str) -> tuple[str, Outcome]:
        play = plays.by_id(store, UUID(play_id))
        assert play is not None
        again = replay(store, live, play)
        decision = again.decision
        item = again.catalogue.shelf(decision.serial).id
        return play_id, (item, decision.predicted, decision.choice.propensity)

    async def run() -> list[tuple[str, Outcome]]:
        database = Database(service.settings)
        live = Live(timedelta(minutes=30))
        try:
            return [
                await database.run(partial(outcome, live=live, play_id=play))
                for play in ids
            ]
        finally:
            await database.close()

    return asyncio.run(run())
