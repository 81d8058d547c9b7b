"""Forms of keys."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Self

from pydantic import (
    AfterValidator,
    ConfigDict,
    Field,
    JsonValue,
    StringConstraints,
    ValidationInfo,
    field_validator,
)

from app.api.schemas.fields import NO_NUL, Form, storable
from app.domain import Key, Scope

LONGEST_GRACE_S = 30 * 86_400.0
ORIGIN = (  # as browsers send it: no path
    r"^https?://[a-z0-9]([a-z0-9.-]{0,251}[a-z0-9])?(:[1-9][0-9]{0,4})?$"
)
USUAL = {"http": ":80", "https": ":443"}


def as_sent(origin: str) -> str:
    """An origin without its usual port, which browsers leave out."""
    return origin.removesuffix(USUAL[origin.partition("://")[0]])


Origin = Annotated[
    str,
    StringConstraints(strict=True, max_length=270, pattern=ORIGIN),
    AfterValidator(as_sent),
    Field(examples=["https://player.example.com"]),
]


FOR_WHOM: list[JsonValue] = [
    {"title": "serve", "properties": {"scope": {"const": "serve"}}},
    {
        "title": "admin",
        "properties": {"scope": {"const": "admin"}, "origins": {"maxItems": 0}},
    },
]


class KeyForm(Form):
    """A key to make."""

    model_config = ConfigDict(json_schema_extra={"oneOf": FOR_WHOM})

    scope: Annotated[
        Scope, Field(description="`serve` listeners, or `admin`: also administer")
    ]
    name: Annotated[
        str,
        StringConstraints(strict=True, min_length=1, max_length=200),
        AfterValidator(storable),
        Field(
            description="who will use it",
            examples=["web player"],
            json_schema_extra={"pattern": NO_NUL},
        ),
    ]

    origins: Annotated[
        tuple[Origin, ...],
        Field(
            max_length=32,
            description="of pages whose scripts may use it; none: no page may. For keys"
            " of scope `serve` alone, since whoever sees the page sees the key",
        ),
    ] = ()

    @field_validator("origins")
    @classmethod
    def _serve_alone(cls, origins: object, info: ValidationInfo) -> object:
        if origins and info.data.get("scope") is Scope.ADMIN:
            raise ValueError("a key that administers must not be seen in pages")
        return origins


class RotateForm(Form):
    """How a key is replaced."""

    grace_s: Annotated[
        float,
        Field(
            strict=True,
            ge=0,
            le=LONGEST_GRACE_S,
            allow_inf_nan=False,
            description="seconds for which the key replaced is still good",
        ),
    ] = 3600.0


class KeyView(Form):
    """A key in force; its secret is not kept."""

    id: str
    scope: Scope
    name: str
    created_at: datetime
    expires_at: Annotated[
        datetime | None, Field(description="null: good until it is revoked")
    ]
    origins: Annotated[
        Sequence[str], Field(description="of pages whose scripts may use it")
    ]

    @classmethod
    def of(cls, key: Key) -> Self:
        return cls(
            id=key.id,
            scope=key.scope,
            name=key.name,
            created_at=key.created_at,
            expires_at=key.expires_at,
            origins=key.origins,
        )


class KeyList(Form):
    keys: list[KeyView]


class KeyMade(KeyView):
    """A new key, and its secret: shown now and never again."""

    key: Annotated[str, Field(description="send it as `Authorization: Bearer …`")]

    @classmethod
    def with_secret(cls, key: Key, secret: str) -> Self:
        return cls(**dict(KeyView.of(key)), key=secret)
