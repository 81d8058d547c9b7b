"""Let experiments split users."""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for name in ("experiment", "tally"):
        op.add_column(
            "revision",
            sa.Column(name, sa.Integer(), server_default="0", nullable=False),
        )
    op.add_column("policies", sa.Column("experiment", sa.Integer(), nullable=True))
    op.add_column(
        "policies", sa.Column("rungs", sa.JSON(none_as_null=True), nullable=True)
    )
    op.add_column("plays", sa.Column("experiment", sa.Integer(), nullable=True))
    op.add_column("plays", sa.Column("arm", sa.String(length=64), nullable=True))
    op.add_column("plays", sa.Column("rung", sa.Integer(), nullable=True))
    op.create_table(
        "experiments",
        sa.Column("version", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("origin", sa.Integer(), nullable=False),
        sa.Column("salt", sa.String(length=32), nullable=False),
        sa.Column("arms", sa.JSON(), nullable=False),
        sa.Column("holdout", sa.Double(), nullable=False),
        sa.Column("control", sa.String(length=64), nullable=True),
        sa.Column("split", sa.JSON(), nullable=False),
        sa.Column("shadows", sa.JSON(), nullable=False),
        sa.Column("policy", sa.Integer(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("by", sa.String(length=64), nullable=False),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("ended_by", sa.String(length=64), nullable=True),
        sa.Column("ended_note", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("version", name=op.f("pk_experiments")),
    )
    op.create_table(
        "tally",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("after", sa.Uuid(), nullable=False),
        sa.Column("until", sa.DateTime(timezone=True), nullable=False),
        sa.Column("checked_at", sa.DateTime(timezone=True), nullable=False),
        sa.CheckConstraint("id = 1", name=op.f("ck_tally_single")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_tally")),
    )
    op.create_table(
        "arm_users",
        sa.Column("user_id", sa.String(length=128), nullable=False),
        sa.Column("experiment", sa.Integer(), nullable=False),
        sa.Column("arm", sa.String(length=64), nullable=False),
        sa.Column("plays", sa.Integer(), nullable=False),
        sa.Column("answered", sa.Integer(), nullable=False),
        sa.Column("earned", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("user_id", name=op.f("pk_arm_users")),
    )
    op.create_table(
        "arm_totals",
        sa.Column("experiment", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("arm", sa.String(length=64), nullable=False),
        sa.Column("users", sa.BigInteger(), nullable=False),
        sa.Column("plays", sa.BigInteger(), nullable=False),
        sa.Column("moved", sa.BigInteger(), nullable=False),
        sa.Column("sums", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("experiment", "arm", name=op.f("pk_arm_totals")),
    )
    op.create_table(
        "shadow_totals",
        sa.Column("experiment", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("shadow", sa.String(length=64), nullable=False),
        sa.Column("part", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("decisions", sa.BigInteger(), nullable=False),
        sa.Column("agreed", sa.BigInteger(), nullable=False),
        sa.Column("gained", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint(
            "experiment", "shadow", "part", name=op.f("pk_shadow_totals")
        ),
    )


def downgrade() -> None:
    # The release before numbers the next policy after the one in force.
    op.execute(
        """
        INSERT INTO policies (version, name, params, note, activated_at, "by", restores)
        SELECT
            (SELECT max(version) FROM policies) + 1,
            name, params, note, activated_at, "by", version
        FROM policies
        WHERE version = (SELECT policy FROM revision)
            AND version < (SELECT max(version) FROM policies)
        """
    )
    op.execute(
        "UPDATE revision SET policy = (SELECT max(version) FROM policies)"
        " WHERE policy > 0"
    )
    for table in ("shadow_totals", "arm_totals", "arm_users", "tally", "experiments"):
        op.drop_table(table)
    for column in ("rung", "arm", "experiment"):
        op.drop_column("plays", column)
    for column in ("rungs", "experiment"):
        op.drop_column("policies", column)
    for column in ("tally", "experiment"):
        op.drop_column("revision", column)
