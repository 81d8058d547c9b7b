"""What an operator can set: environment variables named ENCORE_*."""

import os
from datetime import timedelta
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, SecretStr, field_validator
from pydantic_settings import (
    BaseSettings,
    PydanticBaseSettingsSource,
    SecretsSettingsSource,
    SettingsConfigDict,
    SettingsError,
)

SECRETS = "ENCORE_SECRETS_DIR"
SCHEMES = {
    "sqlite": "sqlite",
    "postgresql": "postgresql+asyncpg",
    "postgres": "postgresql+asyncpg",
    "postgresql+asyncpg": "postgresql+asyncpg",
}


class Settings(BaseSettings):
    model_config = SettingsConfigDict(
        env_prefix="ENCORE_", extra="ignore", hide_input_in_errors=True
    )

    database_url: str = Field(
        default="sqlite:///encore.db",
        description="where everything is kept: sqlite:///FILE or postgresql://…",
    )
    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen on")
    workers: int = Field(
        default=1, ge=1, le=64, description="processes (PostgreSQL only)"
    )
    bootstrap_key: SecretStr | None = Field(
        default=None,
        min_length=16,
        max_length=256,
        description="an admin key known in advance (containers, tests)",
    )
    pending_ttl: timedelta = Field(
        default=timedelta(minutes=30),
        gt=timedelta(0),
        description="seconds after which an unanswered play counts as none",
    )
    decision_budget: float = Field(
        default=50,
        gt=0,
        le=3_600_000,
        description="milliseconds in which a play is to be chosen",
    )
    experiment_least_share: float = Field(
        default=0.01,
        ge=0.0001,
        le=0.5,
        description="least share of users that an arm of an experiment may have",
    )
    like_fraction: float = Field(
        default=0.8,
        gt=0,
        le=1,
        description="share of an item that must be played to count as a like",
    )
    simulation_budget: timedelta = Field(
        default=timedelta(seconds=60),
        ge=timedelta(0),
        description="seconds that a simulation asked for over HTTP may take",
    )
    body_limit: int = Field(
        default=1_000_000, ge=1_000, description="bytes in a request body"
    )
    import_limit: int = Field(
        default=1_000_000_000, ge=1_000, description="bytes in an import"
    )
    key_rate: float | None = Field(
        default=None,
        gt=0,
        allow_inf_nan=False,
        description="requests a second that one key may make; left out: any number",
    )
    user_rate: float | None = Field(
        default=None,
        gt=0,
        allow_inf_nan=False,
        description="requests a second about one user; left out: any number",
    )
    rate_burst: timedelta = Field(
        default=timedelta(seconds=10),
        ge=timedelta(0),
        description="seconds' worth of those requests that may come at once",
    )
    queue_limit: int = Field(
        default=4096,
        ge=1,
        description="units of work that may wait to be written before 503",
    )
    pool_size: int = Field(
        default=8, ge=1, le=200, description="PostgreSQL connections for reading"
    )
    pgbouncer: bool = Field(
        default=False,
        description="PostgreSQL is behind a transaction pooler: no prepared statements",
    )
    index_tables: Literal["auto", "off"] = Field(
        default="auto",
        description="whether this process builds index tables in the background",
    )
    guard: Literal["off", "watch", "fall_back"] = Field(
        default="watch",
        description="what is done about models that predict worse than a constant",
    )
    guard_policy: str = Field(
        default="round_robin",
        max_length=10_000,
        description="policy to fall back to: a name, or JSON with name and params",
    )
    trust_traceparent: bool = Field(
        default=False,
        description="whether a caller's traceparent decides if its request is traced",
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="least severe log line that is written"
    )

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003 - always given
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003 - the same
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """The environment, then files of a folder: each holds the setting it names."""
        folder = os.environ.get(SECRETS)
        if folder is None:
            return init_settings, env_settings
        if not Path(folder).is_dir():
            raise SettingsError(f"{SECRETS}: there is no folder {folder}.")
        return init_settings, env_settings, SecretsSettingsSource(settings_cls, folder)

    @field_validator("database_url")
    @classmethod
    def _known_database(cls, url: str) -> str:
        scheme, separator, rest = url.partition("://")
        if not separator or scheme not in SCHEMES or rest in {"", "/"}:
            raise ValueError("expected sqlite:///FILE or postgresql://…")
        return f"{SCHEMES[scheme]}://{rest}"

    @field_validator("pending_ttl", "rate_burst", "simulation_budget", mode="before")
    @classmethod
    def _plain_number_is_seconds(cls, value: object) -> object:
        if isinstance(value, str) and value.replace(".", "", 1).isdigit():
            return min(float(value), timedelta.max.total_seconds())
        return value

    @property
    def on_sqlite(self) -> bool:
        return self.database_url.startswith("sqlite")

    def with_changes(self, **changes: object) -> Self:
        """These settings with some replaced, validated like the rest."""
        kept = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**(kept | changes))


class Telemetry(BaseSettings):
    """Which requests are traced: the standard variables OTEL_*.

    A trace costs more than what it tells of, so it is off if no collector is named, and
    few requests are traced if nothing is said of how many.
    """

    model_config = SettingsConfigDict(
        env_prefix="OTEL_", env_ignore_empty=True, extra="ignore"
    )

    sdk_disabled: bool = False
    traces_exporter: Literal["otlp", "none"] | None = None
    exporter_otlp_endpoint: str | None = Field(default=None, pattern="^https?://")
    exporter_otlp_traces_endpoint: str | None = Field(
        default=None, pattern="^https?://"
    )
    exporter_otlp_protocol: Literal["http/protobuf"] = "http/protobuf"
    exporter_otlp_traces_protocol: Literal["http/protobuf"] = "http/protobuf"
    traces_sampler: Literal[
        "always_on",
        "always_off",
        "traceidratio",
        "parentbased_always_on",
        "parentbased_always_off",
        "parentbased_traceidratio",
    ] = "traceidratio"
    traces_sampler_arg: float = Field(default=0.01, ge=0, le=1)

    @property
    def on(self) -> bool:
        if self.sdk_disabled or self.traces_exporter == "none":
            return False
        endpoints = self.exporter_otlp_endpoint, self.exporter_otlp_traces_endpoint
        return self.traces_exporter == "otlp" or any(endpoints)

    @property
    def share(self) -> float:
        """Of requests without a caller's trace that is trusted, how many are traced."""
        match self.traces_sampler.removeprefix("parentbased_"):
            case "always_on":
                return 1.0
            case "always_off":
                return 0.0
            case _:
                return self.traces_sampler_arg
