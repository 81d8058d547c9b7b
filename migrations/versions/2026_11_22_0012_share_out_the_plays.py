"""Share out the plays by user, on PostgreSQL."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

PARTITIONS = 8  # more would slow the search by a play alone
UNIQUE = (
    ("uq_plays_user_id_closed_place", ("closed", "place"), None),
    ("uq_plays_pending", ("place",), "closed IS NULL"),
    (
        "uq_plays_user_id_idempotency_key",
        ("idempotency_key",),
        "idempotency_key IS NOT NULL",
    ),
)


def upgrade() -> None:
    _move("PARTITION BY HASH (user_id)", PARTITIONS)


def downgrade() -> None:
    _move("", 0)


def _move(by: str, partitions: int) -> None:
    """Copy the plays into a table that is parted otherwise; all columns stay."""
    if op.get_bind().dialect.name != "postgresql":
        return
    op.execute("ALTER TABLE plays RENAME TO plays_before")
    like = "LIKE plays_before INCLUDING DEFAULTS INCLUDING STORAGE"
    op.execute(f"CREATE TABLE plays ({like}) {by}")
    for number in range(partitions):
        op.execute(
            f"CREATE TABLE plays_{number} PARTITION OF plays"
            f" FOR VALUES WITH (MODULUS {partitions}, REMAINDER {number})"
        )
    op.execute("INSERT INTO plays SELECT * FROM plays_before")
    op.execute("DROP TABLE plays_before")
    op.create_primary_key("pk_plays", "plays", ["user_id", "id"])
    op.create_index("ix_plays_id", "plays", ["id"])
    for name, columns, where in UNIQUE:
        op.create_index(
            name,
            "plays",
            ["user_id", *columns],
            unique=True,
            postgresql_where=None if where is None else sa.text(where),
        )
