"""Forms of keys."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import AfterValidator, Field, StringConstraints

from app.api.schemas.fields import NO_NUL, Form, storable
from app.domain import Key, Scope


class KeyForm(Form):
    """A key to make."""

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


class KeyView(Form):
    """A key in force; its secret is not kept."""

    id: str
    scope: Scope
    name: str
    created_at: datetime

    @classmethod
    def of(cls, key: Key) -> Self:
        return cls(id=key.id, scope=key.scope, name=key.name, created_at=key.created_at)


class KeyList(Form):
    keys: list[KeyView]


class KeyMade(KeyView):
    """A new key, and its secret: shown now and never again."""

    key: Annotated[str, Field(description="send it as `Authorization: Bearer …`")]

    @classmethod
    def with_secret(cls, key: Key, secret: str) -> Self:
        return cls(**dict(KeyView.of(key)), key=secret)
