"""Plain data whose fields are the columns of a table."""

from dataclasses import fields

from app.domain import Experiment, Item, ItemModel, PolicyVersion, Publication


def columns(
    record: Experiment | Item | ItemModel | PolicyVersion | Publication,
) -> dict[str, object]:
    """A record as a row of its table."""
    return {field.name: getattr(record, field.name) for field in fields(record)}
