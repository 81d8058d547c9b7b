"""The revisions lead to the tables, and back."""

from alembic import command

from app.settings import Settings
from app.storage import migrate
from app.storage.tables import metadata


def test_the_revisions_lead_to_the_tables_of_the_code(database_url: str) -> None:
    url = Settings(database_url=database_url).database_url

    command.check(migrate.config(url))


def test_they_lead_down_and_up_again(database_url: str) -> None:
    url = Settings(database_url=database_url).database_url

    migrate.downgrade(url, "base")
    migrate.upgrade(url)

    command.check(migrate.config(url))


def test_every_table_of_a_user_is_keyed_by_the_user_first() -> None:
    for table in metadata.tables.values():
        if "user_id" in table.columns:
            first = next(iter(table.primary_key.columns))
            assert first.name == "user_id", table.name
