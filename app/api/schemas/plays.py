"""Forms of plays, and of why they were chosen."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Self
from uuid import UUID

from pydantic import Field

from app.api.schemas.fields import Chance, Form, Reward
from app.domain import Play, Source
from app.services.catalogue import Shelf
from app.services.explanations import Record


class PlayView(Form):
    """A play as it is kept."""

    play: UUID
    user: str
    item: str
    title: str
    slot: Annotated[
        int | None, Field(description="the slot it took place in, null while pending")
    ]
    decided_slot: Annotated[int, Field(description="the slot it was chosen for")]
    slate: Annotated[
        UUID, Field(description="the first of the plays it was chosen with, or itself")
    ]
    place: Annotated[int, Field(description="its number among them, from 0")]
    source: Source
    signal: str | None
    fraction: Chance | None
    policy: int | None
    rung: Annotated[
        int | None,
        Field(description="of the policy; 0: itself, else what it fell to"),
    ]
    experiment: Annotated[
        int | None, Field(description="version of the experiment it was part of")
    ]
    arm: Annotated[str | None, Field(description="of the experiment")]
    catalogue: int
    model: str
    model_version: int
    seed: Annotated[
        str | None, Field(description="as text: it has more digits than a double")
    ]
    like: Reward
    propensity: Chance | None
    created_at: datetime
    answered_at: datetime | None

    @classmethod
    def of(cls, play: Play, shelf: Shelf) -> Self:
        return cls(
            play=play.id,
            user=play.user,
            item=shelf.id,
            title=shelf.title,
            slot=play.closed,
            decided_slot=play.slot,
            slate=play.slate,
            place=play.place,
            source=play.source,
            signal=play.signal,
            fraction=play.fraction,
            policy=play.policy,
            rung=play.rung,
            experiment=play.experiment,
            arm=play.arm,
            catalogue=play.catalogue,
            model=play.model,
            model_version=play.model_version,
            seed=None if play.seed is None else str(play.seed),
            like=play.predicted,
            propensity=play.propensity,
            created_at=play.created_at,
            answered_at=play.answered_at,
        )


class GroupView(Form):
    """Candidates of which the same is believed; `item` is null where several are."""

    item: str | None
    model: str
    count: int
    states: Sequence[str]
    belief: Sequence[float]
    like: Reward
    score: float
    rested: int | None


class ExplanationView(Form):
    """Why this item: the candidates by score, the one played first."""

    groups: Annotated[
        int, Field(description="how many groups of candidates there were")
    ]
    candidates: list[GroupView]
    runner_up: GroupView | None


class PlayRecord(PlayView):
    """A play, and why it was chosen."""

    explanation: Annotated[
        ExplanationView | None,
        Field(
            description="null: not asked for; reported; or plays that it was chosen by"
            " were dropped since"
        ),
    ] = None

    @classmethod
    def of_record(cls, record: Record) -> Self:
        kept = PlayView.of(record.play, record.shelf)
        return cls.model_validate(
            {**dict(kept), "explanation": record.explanation}, from_attributes=True
        )
