"""Let several plays share a slot, if they were chosen for it together."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

UNANSWERED = sa.text("closed IS NULL")


def upgrade() -> None:
    op.add_column("users", sa.Column("pending_slot", sa.Integer(), nullable=True))
    op.drop_index("uq_plays_pending", "plays")
    op.drop_index("uq_plays_user_id_closed", "plays")
    op.add_column("plays", sa.Column("slate", sa.Uuid(), nullable=True))
    op.add_column("plays", sa.Column("place", sa.Integer(), nullable=True))
    op.execute("UPDATE plays SET slate = id, place = 0")
    with op.batch_alter_table("plays") as plays:
        plays.alter_column("slate", existing_type=sa.Uuid(), nullable=False)
        plays.alter_column("place", existing_type=sa.Integer(), nullable=False)
    op.create_index(
        "uq_plays_user_id_closed_place",
        "plays",
        ["user_id", "closed", "place"],
        unique=True,
    )
    op.create_index(
        "uq_plays_pending",
        "plays",
        ["user_id", "place"],
        unique=True,
        sqlite_where=UNANSWERED,
        postgresql_where=UNANSWERED,
    )


def downgrade() -> None:
    """Give each play a slot of its own; of those that wait together, keep the first."""
    op.drop_index("uq_plays_pending", "plays")
    op.drop_index("uq_plays_user_id_closed_place", "plays")
    for statement in SEPARATE:
        op.execute(statement)
    with op.batch_alter_table("plays") as plays:
        plays.drop_column("place")
        plays.drop_column("slate")
    with op.batch_alter_table("users") as users:
        users.drop_column("pending_slot")
    op.create_index(
        "uq_plays_user_id_closed", "plays", ["user_id", "closed"], unique=True
    )
    op.create_index(
        "uq_plays_pending",
        "plays",
        ["user_id"],
        unique=True,
        sqlite_where=UNANSWERED,
        postgresql_where=UNANSWERED,
    )


SEPARATE = (
    """
    DELETE FROM plays WHERE closed IS NULL AND place > (
        SELECT min(place) FROM plays waiting
        WHERE waiting.user_id = plays.user_id AND waiting.closed IS NULL
    )
    """,
    # A table of its own: a statement may see what it has itself changed.
    """
    CREATE TEMPORARY TABLE renumbered AS
    SELECT
        user_id,
        id,
        closed AS shared,
        row_number() OVER (PARTITION BY user_id ORDER BY closed, place) - 1 AS own
    FROM plays
    WHERE closed IS NOT NULL AND user_id IN (SELECT user_id FROM plays WHERE place > 0)
    """,
    "CREATE INDEX ix_renumbered ON renumbered (user_id, shared)",
    """
    UPDATE plays SET
        closed = (
            SELECT own FROM renumbered
            WHERE renumbered.user_id = plays.user_id AND renumbered.id = plays.id
        )
    WHERE closed IS NOT NULL AND user_id IN (SELECT user_id FROM renumbered)
    """,
    """
    UPDATE plays SET
        slot = (
            SELECT count(*) FROM renumbered
            WHERE renumbered.user_id = plays.user_id AND shared < plays.slot
        )
    WHERE user_id IN (SELECT user_id FROM renumbered)
    """,
    """
    UPDATE users SET
        slot = (SELECT count(*) FROM renumbered WHERE user_id = users.id)
    WHERE id IN (SELECT user_id FROM renumbered)
    """,
    """
    UPDATE beliefs SET epoch = -1
    WHERE user_id IN (SELECT user_id FROM renumbered)
    """,
    "DROP TABLE renumbered",
)
