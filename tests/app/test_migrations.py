"""The revisions lead to the tables, and back."""

import pytest
from alembic import command

from app.settings import Settings
from app.storage import migrate
from app.storage.tables import metadata
from tests.app.service import Service
from tests.catalogues import SERIES
from tests.filter import after_play, reward


def test_the_revisions_lead_to_the_tables_of_the_code(database_url: str) -> None:
    url = Settings(database_url=database_url).database_url

    command.check(migrate.config(url))


def test_they_lead_down_and_up_again(database_url: str) -> None:
    url = Settings(database_url=database_url).database_url

    migrate.downgrade(url, "base")
    migrate.upgrade(url)

    command.check(migrate.config(url))


def test_answers_that_an_earlier_release_cannot_read_go_with_their_models(
    settings: Settings,
) -> None:
    """A model of signals is left with the reward that it expects of a play."""
    partial = {"item": "pilot", "signal": "partial"}
    service = Service.start(settings)
    service.put_model("series", SERIES)
    service.put_item("pilot", "series")
    service.client.post("/v1/users/ann/plays", json=partial).raise_for_status()
    service.stop()

    migrate.downgrade(settings.database_url, "0001")
    migrate.upgrade(settings.database_url)

    service = Service.start(settings)
    model = service.client.get("/v1/models/series").json()
    [play] = service.client.get("/v1/users/ann/plays").json()["plays"]
    [held] = service.beliefs("ann")["beliefs"]
    service.stop()
    assert model["signals"] == ["skip", "like"]
    assert model["like"] == pytest.approx(reward(SERIES), abs=1e-12)
    assert play["signal"] == "none"
    unanswered = after_play(SERIES, SERIES["prior"], "none")
    assert held["belief"] == pytest.approx(unanswered, abs=1e-12)


def test_every_table_of_a_user_is_keyed_by_the_user_first() -> None:
    for table in metadata.tables.values():
        if "user_id" in table.columns:
            first = next(iter(table.primary_key.columns))
            assert first.name == "user_id", table.name
