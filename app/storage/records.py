"""Plain data whose fields are the columns of a table."""

from collections.abc import Mapping
from dataclasses import fields

from app.domain import Item, ItemModel, PolicyVersion


def columns(record: Item | ItemModel | PolicyVersion) -> Mapping[str, object]:
    """A record as a row of its table."""
    return {field.name: getattr(record, field.name) for field in fields(record)}
