"""Plays that wait for their answers, and what a client shows of them."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.domain import Play, PolicyVersion, Slate
from app.services.catalogue import Catalogue, Shelf


@dataclass(frozen=True, slots=True)
class Offer:
    """What to play now.

    plays:  by place, with what is known of their items
    slot:   in which they will take place if one of them is answered next
    policy: that chose them
    took:   seconds that the decision took, None if they were offered before
    """

    plays: Sequence[tuple[Play, Shelf]]
    slot: int
    policy: PolicyVersion
    took: float | None

    @classmethod
    def of(
        cls,
        catalogue: Catalogue,
        pending: Slate,
        slot: int,
        policy: PolicyVersion,
        took: float | None = None,
    ) -> "Offer":
        """What is pending in a user's present slot."""
        plays = [(play, catalogue.shelf(play.item)) for play in pending.waiting]
        return cls(plays, pending.slot(slot), policy, took)

    @property
    def repeated(self) -> bool:
        """Whether it was made before, and has not been answered."""
        return self.took is None

    @property
    def first(self) -> Play:
        return self.plays[0][0]
