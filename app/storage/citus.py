"""The way to several nodes: statements that distribute the tables with Citus.

What belongs to a user lies on one node, by the user's id; all else is copied to all.
"""

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.dialects.postgresql.base import PGDialect
from sqlalchemy.schema import AddConstraint, CreateIndex

from app.storage.tables import metadata, plays

BY_USER = {
    "users": "id",
    "beliefs": "user_id",
    "plays": "user_id",
    "arm_users": "user_id",
}
UNDIVIDED = (  # nodes divide them further: partitions would be of no more use
    "ALTER TABLE plays RENAME TO plays_before",
    "CREATE TABLE plays (LIKE plays_before INCLUDING DEFAULTS INCLUDING STORAGE)",
    "INSERT INTO plays SELECT * FROM plays_before",
    "DROP TABLE plays_before",
)


def statements() -> Sequence[str]:
    """What to run once on the coordinator, after the tables were made."""
    first, *others = BY_USER
    return [
        *UNDIVIDED,
        _text(AddConstraint(plays.primary_key)),
        *(_text(CreateIndex(index)) for index in sorted(plays.indexes, key=_name)),
        f"SELECT create_distributed_table('{first}', '{BY_USER[first]}')",
        *(
            f"SELECT create_distributed_table('{table}', '{BY_USER[table]}',"
            f" colocate_with => '{first}')"
            for table in others
        ),
        *(
            f"SELECT create_reference_table('{table.name}')"
            for table in metadata.sorted_tables
            if table.name not in BY_USER
        ),
    ]


def _text(element: sa.schema.DDLElement) -> str:
    dialect = PGDialect()  # type: ignore[no-untyped-call]
    return " ".join(str(element.compile(dialect=dialect)).split())


def _name(index: sa.Index) -> str:
    return str(index.name)
