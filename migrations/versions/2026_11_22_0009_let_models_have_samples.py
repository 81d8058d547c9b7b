"""Let models have samples, each with index tables of its own."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

TABLES = {
    "index_tables": ("model", "version", "discount", "precision"),
    "index_builds": ("model", "version", "discount"),
}


def upgrade() -> None:
    op.add_column(
        "models", sa.Column("samples", sa.JSON(none_as_null=True), nullable=True)
    )
    for table, key in TABLES.items():
        with op.batch_alter_table(table) as batch:
            batch.add_column(
                sa.Column("sample", sa.Integer(), nullable=False, server_default="0")
            )
            batch.drop_constraint(f"pk_{table}", type_="primary")
            batch.create_primary_key(f"pk_{table}", [*key, "sample"])


def downgrade() -> None:
    # The release before knows the middle of samples: what it believes it has to believe
    # anew.
    op.execute(
        "UPDATE revision SET catalogue = catalogue + 1, epoch = catalogue + 1"
        " WHERE EXISTS (SELECT 1 FROM models WHERE samples IS NOT NULL)"
    )
    for table, key in TABLES.items():
        # Tables and builds of samples: of no use to the middle.
        op.execute(
            f"DELETE FROM {table} WHERE EXISTS (SELECT 1 FROM models"  # noqa: S608 - ours
            f" WHERE models.id = {table}.model AND models.version = {table}.version"
            " AND models.samples IS NOT NULL)"
        )
        with op.batch_alter_table(table) as batch:
            batch.drop_constraint(f"pk_{table}", type_="primary")
            batch.create_primary_key(f"pk_{table}", [*key])
            batch.drop_column("sample")
    op.drop_column("models", "samples")
