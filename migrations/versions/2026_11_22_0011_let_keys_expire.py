"""Let keys expire, and be used from pages of certain origins."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "keys", sa.Column("expires_at", sa.DateTime(timezone=True), nullable=True)
    )
    op.add_column(
        "keys", sa.Column("origins", sa.JSON(none_as_null=True), nullable=True)
    )


def downgrade() -> None:
    # The release before knows no end but revocation, and no origins: keys that have one
    # would allow more than they were made for.
    op.execute(
        "UPDATE keys SET revoked_at = CURRENT_TIMESTAMP WHERE revoked_at IS NULL"
        " AND (expires_at IS NOT NULL OR origins IS NOT NULL)"
    )
    op.drop_column("keys", "origins")
    op.drop_column("keys", "expires_at")
