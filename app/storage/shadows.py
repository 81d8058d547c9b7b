"""What policies would have chosen that decide in the shade of an experiment."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass

import sqlalchemy as sa

from app.storage.store import Store
from app.storage.tables import shadow_totals


@dataclass(frozen=True, slots=True)
class ShadowTotal:
    """Decisions of a shadow about one part of all users.

    experiment: the version with which it began
    agreed:     decisions for the item that was served, or its equal
    gained:     expected rewards of its choices, less those of what was served
    """

    experiment: int
    shadow: str
    part: int
    decisions: int
    agreed: int
    gained: float


TOTALS = sa.select(shadow_totals).where(
    shadow_totals.c.experiment == sa.bindparam("experiment")
)
ADD = sa.text(
    "INSERT INTO shadow_totals"
    " (experiment, shadow, part, decisions, agreed, gained)"
    " VALUES (:experiment, :shadow, :part, :decisions, :agreed, :gained)"
    " ON CONFLICT (experiment, shadow, part) DO UPDATE SET"
    " decisions = shadow_totals.decisions + excluded.decisions,"
    " agreed = shadow_totals.agreed + excluded.agreed,"
    " gained = shadow_totals.gained + excluded.gained"
)


def add(store: Store, totals: Collection[ShadowTotal]) -> None:
    """Note further decisions, to be added to those that are known."""
    if totals:
        store.write(ADD, *map(asdict, totals))


def by_shadow(store: Store, experiment: int) -> Mapping[str, Sequence[ShadowTotal]]:
    """What is known of each shadow of an experiment, by parts of users."""
    found: dict[str, list[ShadowTotal]] = {}
    for row in store.rows(TOTALS, {"experiment": experiment}):
        total = ShadowTotal(**row._asdict())
        found.setdefault(total.shadow, []).append(total)
    return found
