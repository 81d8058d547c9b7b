"""Let plays be dropped after a while."""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

COLUMNS = ("kept_from", "replayed_from")


def upgrade() -> None:
    for name in COLUMNS:
        op.add_column(
            "users", sa.Column(name, sa.Integer(), nullable=False, server_default="0")
        )


def downgrade() -> None:
    for name in COLUMNS:
        op.drop_column("users", name)
