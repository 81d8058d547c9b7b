"""Let slots follow a clock."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "revision",
        sa.Column("clock", sa.Integer(), server_default="0", nullable=False),
    )
    op.add_column("revision", sa.Column("slot_s", sa.Double(), nullable=True))
    op.add_column(
        "users", sa.Column("clock", sa.Integer(), server_default="0", nullable=False)
    )
    op.add_column(
        "users", sa.Column("began", sa.BigInteger(), server_default="0", nullable=False)
    )


def downgrade() -> None:
    """Count the slots of users who followed a clock by plays."""
    for statement in RENUMBER:
        op.execute(statement)
    op.drop_column("users", "began")
    op.drop_column("users", "clock")
    op.drop_column("revision", "slot_s")
    op.drop_column("revision", "clock")


RENUMBER = (
    # A table of its own: a statement may see what it has itself changed.
    """
    CREATE TEMPORARY TABLE renumbered AS
    SELECT
        user_id,
        closed AS passed,
        row_number() OVER (PARTITION BY user_id ORDER BY closed) - 1 AS played
    FROM (
        SELECT DISTINCT user_id, closed FROM plays
        WHERE closed IS NOT NULL AND user_id IN (SELECT id FROM users WHERE clock > 0)
    ) AS slots
    """,
    "CREATE INDEX ix_renumbered ON renumbered (user_id, passed)",
    """
    UPDATE plays SET
        slot = (
            SELECT count(*) FROM renumbered
            WHERE renumbered.user_id = plays.user_id AND passed < plays.slot
        )
    WHERE user_id IN (SELECT id FROM users WHERE clock > 0)
    """,
    # Below zero first: there no slot is taken that another play still has.
    """
    UPDATE plays SET
        closed = (
            SELECT -1 - played FROM renumbered
            WHERE renumbered.user_id = plays.user_id AND passed = plays.closed
        )
    WHERE closed IS NOT NULL AND user_id IN (SELECT id FROM users WHERE clock > 0)
    """,
    """
    UPDATE plays SET closed = -1 - closed
    WHERE closed < 0 AND user_id IN (SELECT id FROM users WHERE clock > 0)
    """,
    """
    UPDATE users SET
        pending_slot = (
            SELECT played FROM renumbered
            WHERE user_id = users.id AND passed = users.pending_slot
        ),
        slot = (SELECT count(*) FROM renumbered WHERE user_id = users.id)
    WHERE clock > 0
    """,
    """
    UPDATE beliefs SET epoch = -1
    WHERE user_id IN (SELECT id FROM users WHERE clock > 0)
    """,
    "DROP TABLE renumbered",
)
