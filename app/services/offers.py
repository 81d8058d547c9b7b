"""Plays that wait for their answers, and what a client shows of them."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.domain import Play, PolicyVersion, Slate
from app.services.catalogue import Catalogue, Shelf
from app.services.ladder import Decided
from app.services.shade import Considered


@dataclass(frozen=True, slots=True)
class Offered:
    """One of them. `signals`: names of the answers that its model knows."""

    play: Play
    shelf: Shelf
    signals: Sequence[str]


@dataclass(frozen=True, slots=True)
class Offer:
    """What to play now.

    plays:  by place
    slot:   in which they will take place if one of them is answered next
    policy: that chose them
    took:   seconds that the decision took, None if they were offered before
    decided: how it was taken
    considered: what shadows may decide, too
    """

    plays: Sequence[Offered]
    slot: int
    policy: PolicyVersion
    took: float | None = None
    decided: Decided | None = None
    considered: Considered | None = None

    @classmethod
    def of(
        cls,
        catalogue: Catalogue,
        pending: Slate,
        slot: int,
        policy: PolicyVersion,
    ) -> "Offer":
        """What is pending in a user's present slot."""
        plays = [
            Offered(play, catalogue.shelf(play.item), model.answers)
            for play in pending.waiting
            for model in (catalogue.model_of(play.item),)
        ]
        return cls(plays, pending.slot(slot), policy)

    @property
    def repeated(self) -> bool:
        """Whether it was made before, and has not been answered."""
        return self.took is None

    @property
    def first(self) -> Play:
        return self.plays[0].play
