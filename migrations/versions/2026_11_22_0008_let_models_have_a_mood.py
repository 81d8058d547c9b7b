"""Let models have a mood."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "models", sa.Column("mood", sa.JSON(none_as_null=True), nullable=True)
    )


def downgrade() -> None:
    # The release before knows the means over moods: what it believes it has to believe
    # anew.
    op.execute(
        "UPDATE revision SET catalogue = catalogue + 1, epoch = catalogue + 1"
        " WHERE EXISTS (SELECT 1 FROM models WHERE mood IS NOT NULL)"
    )
    op.drop_column("models", "mood")
