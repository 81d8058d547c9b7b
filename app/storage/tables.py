"""The tables. Everything that belongs to a user is keyed by the user first."""

from datetime import UTC, datetime

import sqlalchemy as sa
from sqlalchemy.engine import Dialect
from sqlalchemy.types import TypeDecorator

metadata = sa.MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "pk": "pk_%(table_name)s",
    }
)


class Instant(TypeDecorator[datetime]):
    """A moment in UTC; SQLite, which knows no time zones, keeps it without one."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(
        self, value: datetime | None, dialect: Dialect
    ) -> datetime | None:
        if value is None or dialect.name != "sqlite":
            return value
        return value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(
        self, value: datetime | None, dialect: Dialect
    ) -> datetime | None:
        if value is None or dialect.name != "sqlite":
            return value
        return value.replace(tzinfo=UTC)


ID = sa.String(128)

revision = sa.Table(
    "revision",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("catalogue", sa.Integer, nullable=False),
    sa.Column("epoch", sa.Integer, nullable=False),
    sa.Column("policy", sa.Integer, nullable=False),
    sa.Column("guard", sa.Integer, nullable=False, server_default="0"),
    sa.Column("clock", sa.Integer, nullable=False, server_default="0"),
    sa.Column("slot_s", sa.Double, nullable=True),
    sa.Column("experiment", sa.Integer, nullable=False, server_default="0"),
    sa.Column("tally", sa.Integer, nullable=False, server_default="0"),
    sa.CheckConstraint("id = 1", name="single"),
)

models = sa.Table(
    "models",
    metadata,
    sa.Column("id", ID, primary_key=True),
    sa.Column("version", sa.Integer, primary_key=True),
    sa.Column("states", sa.JSON, nullable=False),
    sa.Column("play", sa.JSON, nullable=False),
    sa.Column("rest", sa.JSON, nullable=False),
    sa.Column("like", sa.JSON, nullable=False),
    sa.Column("prior", sa.JSON, nullable=False),
    sa.Column("source", sa.Text, nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("catalogue", sa.Integer, nullable=False),
    sa.Column("retired", sa.Boolean, nullable=False),
    sa.Column("signals", sa.JSON(none_as_null=True), nullable=True),
    sa.Column("mood", sa.JSON(none_as_null=True), nullable=True),
    sa.Column("samples", sa.JSON(none_as_null=True), nullable=True),
    sa.Index(None, "catalogue"),
)

items = sa.Table(
    "items",
    metadata,
    sa.Column("serial", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("id", ID, nullable=False, unique=True),
    sa.Column("model", ID, nullable=False),
    sa.Column("title", sa.Text, nullable=False),
    sa.Column("tags", sa.JSON, nullable=False),
    sa.Column("payload", sa.JSON, nullable=False),
    sa.Column("active", sa.Boolean, nullable=False),
    sa.Column("catalogue", sa.Integer, nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("updated_at", Instant, nullable=False),
    sa.Index(None, "catalogue"),
    sa.Index(None, "model"),
)

item_history = sa.Table(
    "item_history",
    metadata,
    sa.Column("serial", sa.Integer, primary_key=True),
    sa.Column("catalogue", sa.Integer, primary_key=True),
    sa.Column("model", ID, nullable=False),
    sa.Column("tags", sa.JSON, nullable=False),
    sa.Column("active", sa.Boolean, nullable=False),
)

users = sa.Table(
    "users",
    metadata,
    sa.Column("id", ID, primary_key=True),
    sa.Column("slot", sa.Integer, nullable=False),
    sa.Column("pending", sa.Uuid, nullable=True),
    sa.Column("pending_slot", sa.Integer, nullable=True),
    sa.Column("version", sa.BigInteger, nullable=False),
    sa.Column("last_seen", Instant, nullable=False),
    sa.Column("clock", sa.Integer, nullable=False, server_default="0"),
    sa.Column("began", sa.BigInteger, nullable=False, server_default="0"),
    sa.Column("kept_from", sa.Integer, nullable=False, server_default="0"),
    sa.Column("replayed_from", sa.Integer, nullable=False, server_default="0"),
)

beliefs = sa.Table(
    "beliefs",
    metadata,
    sa.Column("user_id", ID, primary_key=True),
    sa.Column("epoch", sa.Integer, nullable=False),
    sa.Column("packed", sa.LargeBinary, nullable=False),
)

plays = sa.Table(
    "plays",
    metadata,
    sa.Column("user_id", ID, primary_key=True),
    sa.Column("id", sa.Uuid, primary_key=True),
    sa.Column("slate", sa.Uuid, nullable=False),
    sa.Column("place", sa.Integer, nullable=False),
    sa.Column("item", sa.Integer, nullable=False),
    sa.Column("slot", sa.Integer, nullable=False),
    sa.Column("closed", sa.Integer, nullable=True),
    sa.Column("source", sa.String(16), nullable=False),
    sa.Column("policy", sa.Integer, nullable=True),
    sa.Column("catalogue", sa.Integer, nullable=False),
    sa.Column("model", ID, nullable=False),
    sa.Column("model_version", sa.Integer, nullable=False),
    sa.Column("seed", sa.BigInteger, nullable=True),
    sa.Column("selection", sa.JSON(none_as_null=True), nullable=True),
    sa.Column("predicted", sa.Double, nullable=False),
    sa.Column("propensity", sa.Double, nullable=True),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("signal", sa.String(64), nullable=True),
    sa.Column("fraction", sa.Double, nullable=True),
    sa.Column("answered_at", Instant, nullable=True),
    sa.Column("idempotency_key", sa.String(255), nullable=True),
    sa.Column("experiment", sa.Integer, nullable=True),
    sa.Column("arm", sa.String(64), nullable=True),
    sa.Column("rung", sa.Integer, nullable=True),
    sa.Index(None, "id"),
    sa.Index(
        "uq_plays_user_id_closed_place", "user_id", "closed", "place", unique=True
    ),
    sa.Index(
        "uq_plays_pending",
        "user_id",
        "place",
        unique=True,
        sqlite_where=sa.text("closed IS NULL"),
        postgresql_where=sa.text("closed IS NULL"),
    ),
    sa.Index(
        "uq_plays_user_id_idempotency_key",
        "user_id",
        "idempotency_key",
        unique=True,
        sqlite_where=sa.text("idempotency_key IS NOT NULL"),
        postgresql_where=sa.text("idempotency_key IS NOT NULL"),
    ),
    postgresql_partition_by="HASH (user_id)",
)

policies = sa.Table(
    "policies",
    metadata,
    sa.Column("version", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("name", sa.String(64), nullable=False),
    sa.Column("params", sa.JSON, nullable=False),
    sa.Column("note", sa.Text, nullable=False),
    sa.Column("activated_at", Instant, nullable=False),
    sa.Column("by", sa.String(64), nullable=False),
    sa.Column("restores", sa.Integer, nullable=True),
    sa.Column("experiment", sa.Integer, nullable=True),
    sa.Column("rungs", sa.JSON(none_as_null=True), nullable=True),
)

experiments = sa.Table(
    "experiments",
    metadata,
    sa.Column("version", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("name", sa.String(64), nullable=False),
    sa.Column("origin", sa.Integer, nullable=False),
    sa.Column("salt", sa.String(32), nullable=False),
    sa.Column("arms", sa.JSON, nullable=False),
    sa.Column("holdout", sa.Double, nullable=False),
    sa.Column("control", sa.String(64), nullable=True),
    sa.Column("split", sa.JSON, nullable=False),
    sa.Column("shadows", sa.JSON, nullable=False),
    sa.Column("policy", sa.Integer, nullable=False),
    sa.Column("note", sa.Text, nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("by", sa.String(64), nullable=False),
    sa.Column("ended_at", Instant, nullable=True),
    sa.Column("ended_by", sa.String(64), nullable=True),
    sa.Column("ended_note", sa.Text, nullable=True),
)

tally = sa.Table(
    "tally",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("after", sa.Uuid, nullable=False),
    sa.Column("until", Instant, nullable=False),
    sa.Column("checked_at", Instant, nullable=False),
    sa.CheckConstraint("id = 1", name="single"),
)

arm_users = sa.Table(
    "arm_users",
    metadata,
    sa.Column("user_id", ID, primary_key=True),
    sa.Column("experiment", sa.Integer, nullable=False),
    sa.Column("arm", sa.String(64), nullable=False),
    sa.Column("plays", sa.Integer, nullable=False),
    sa.Column("answered", sa.Integer, nullable=False),
    sa.Column("earned", sa.Double, nullable=False),
)

arm_totals = sa.Table(
    "arm_totals",
    metadata,
    sa.Column("experiment", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("arm", sa.String(64), primary_key=True),
    sa.Column("users", sa.BigInteger, nullable=False),
    sa.Column("plays", sa.BigInteger, nullable=False),
    sa.Column("moved", sa.BigInteger, nullable=False),
    sa.Column("sums", sa.JSON, nullable=False),
)

shadow_totals = sa.Table(
    "shadow_totals",
    metadata,
    sa.Column("experiment", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("shadow", sa.String(64), primary_key=True),
    sa.Column("part", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("decisions", sa.BigInteger, nullable=False),
    sa.Column("agreed", sa.BigInteger, nullable=False),
    sa.Column("gained", sa.Double, nullable=False),
)

index_tables = sa.Table(
    "index_tables",
    metadata,
    sa.Column("model", ID, primary_key=True),
    sa.Column("version", sa.Integer, primary_key=True),
    sa.Column("discount", sa.Double, primary_key=True),
    sa.Column("precision", sa.String(8), primary_key=True),
    sa.Column("sample", sa.Integer, primary_key=True, server_default="0"),
    sa.Column("catalogue", sa.Integer, nullable=False),
    sa.Column("states", sa.Integer, nullable=False),
    sa.Column("divisions", sa.Integer, nullable=False),
    sa.Column("value_divisions", sa.Integer, nullable=False),
    sa.Column("points", sa.Integer, nullable=False),
    sa.Column("reached", sa.Integer, nullable=False),
    sa.Column("unsettled", sa.Integer, nullable=False),
    sa.Column("unsettled_elsewhere", sa.Integer, nullable=False),
    sa.Column("error", sa.Double, nullable=False),
    sa.Column("low", sa.Double, nullable=False),
    sa.Column("high", sa.Double, nullable=False),
    sa.Column("seconds", sa.Double, nullable=False),
    sa.Column("built_at", Instant, nullable=False),
    sa.Column("packed", sa.LargeBinary, nullable=False),
    sa.Index(None, "catalogue"),
    sa.Index(None, "discount"),
)

index_builds = sa.Table(
    "index_builds",
    metadata,
    sa.Column("model", ID, primary_key=True),
    sa.Column("version", sa.Integer, primary_key=True),
    sa.Column("discount", sa.Double, primary_key=True),
    sa.Column("sample", sa.Integer, primary_key=True, server_default="0"),
    sa.Column("worker", sa.String(32), nullable=False),
    sa.Column("renewed_at", Instant, nullable=False),
    sa.Column("progress", sa.Double, nullable=False),
)

guard = sa.Table(
    "guard",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("after", sa.Uuid, nullable=False),
    sa.Column("checked_at", Instant, nullable=False),
    sa.CheckConstraint("id = 1", name="single"),
)

judgements = sa.Table(
    "judgements",
    metadata,
    sa.Column("model", ID, primary_key=True),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("policy", sa.Integer, nullable=False),
    sa.Column("state", sa.String(8), nullable=False),
    sa.Column("since", Instant, nullable=False),
    sa.Column("streak", sa.Integer, nullable=False),
    sa.Column("falls", sa.Integer, nullable=False),
    sa.Column("answers", sa.Integer, nullable=False),
    sa.Column("fresh", sa.Integer, nullable=False),
    sa.Column("scores", sa.JSON(none_as_null=True), nullable=True),
    sa.Column("outcomes", sa.LargeBinary, nullable=False),
)

publications = sa.Table(
    "publications",
    metadata,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("catalogue", sa.Integer, nullable=False),
    sa.Column("digest", sa.String(64), nullable=False),
    sa.Column("models", sa.JSON, nullable=False),
    sa.Column("items", sa.Integer, nullable=False),
    sa.Column("verdict", sa.JSON, nullable=False),
    sa.Column("note", sa.Text, nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("by", sa.String(64), nullable=False),
    sa.Column("undone_at", Instant, nullable=True),
    sa.Column("undone_by", sa.String(64), nullable=True),
)

keys = sa.Table(
    "keys",
    metadata,
    sa.Column("id", sa.String(64), primary_key=True),
    sa.Column("digest", sa.LargeBinary(32), nullable=False, unique=True),
    sa.Column("scope", sa.String(16), nullable=False),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("revoked_at", Instant, nullable=True),
    sa.Column("expires_at", Instant, nullable=True),
    sa.Column("origins", sa.JSON(none_as_null=True), nullable=True),
)

audit = sa.Table(
    "audit",
    metadata,
    sa.Column("id", sa.Uuid, primary_key=True),
    sa.Column("at", Instant, nullable=False),
    sa.Column("by", sa.String(64), nullable=False),
    sa.Column("action", sa.String(64), nullable=False),
    sa.Column("subject", sa.Text, nullable=False),
    sa.Column("detail", sa.JSON, nullable=False),
    sa.Index(None, "at"),
)
