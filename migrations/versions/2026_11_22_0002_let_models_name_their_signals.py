"""Let models name their signals."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "models", sa.Column("signals", sa.JSON(none_as_null=True), nullable=True)
    )


def downgrade() -> None:
    # The release before knows a skip and a like: it cannot read any other answer, and
    # what it believes of the items of such models it has to believe anew.
    op.execute(
        "UPDATE plays SET signal = 'none' WHERE signal NOT IN ('like', 'skip', 'none')"
    )
    op.execute("UPDATE revision SET catalogue = catalogue + 1, epoch = catalogue + 1")
    op.drop_column("models", "signals")
