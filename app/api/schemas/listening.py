"""Forms of the loop that listeners live in."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Self, TypeAlias
from uuid import UUID

from fastapi import Query
from pydantic import BeforeValidator, ConfigDict, Field, JsonValue, model_validator

from app.api.schemas.fields import Chance, Form, Id, Reward, SignalName, whole
from app.api.schemas.plays import ExplanationView
from app.domain import Selection
from app.services.listening import Feedback
from app.services.offers import Offer, Offered

MOST = 50
Ids = Annotated[list[Id], Field(max_length=10_000)]
Count = Annotated[int, Query(ge=1, le=MOST, description="how many for one slot")]


class AmongForm(Form):
    """Which items may be chosen, by the names that the query has."""

    tag: Annotated[
        Ids, Field(default_factory=list, description="the item carries all of these")
    ]
    candidate: Annotated[
        Ids | None, Field(description="it is one of these", min_length=1)
    ] = None
    exclude: Annotated[
        Ids, Field(default_factory=list, description="it is none of these")
    ]

    def selection(self) -> Selection:
        named = None if self.candidate is None else tuple(self.candidate)
        return Selection(tuple(self.tag), named, tuple(self.exclude))


class SelectionForm(AmongForm):
    """The same for the next play."""

    count: Annotated[
        int,
        Field(strict=True, ge=1, le=MOST, description="how many for one slot"),
        BeforeValidator(whole),
    ] = 1
    explain: Annotated[
        bool, Field(strict=True, description="also tell why this item")
    ] = False


ONE_OF_BOTH: list[JsonValue] = [
    {
        "title": present,
        "required": [present],
        "properties": {present: {"not": {"type": "null"}}, absent: {"type": "null"}},
    }
    for present, absent in (("signal", "fraction"), ("fraction", "signal"))
]


class FeedbackForm(Form):
    """The answer to a play: a signal, or the share of the item that was played."""

    model_config = ConfigDict(json_schema_extra={"oneOf": ONE_OF_BOTH})

    signal: Annotated[
        SignalName | None,
        Field(
            description="one that the item's model has: skip or like, unless it names"
            " others; or none: it was never answered",
            examples=["like"],
        ),
    ] = None
    fraction: Annotated[Chance | None, Field(strict=True, examples=[0.93])] = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.signal is None) == (self.fraction is None):
            raise ValueError("give either a signal or a fraction")
        return self


class PolicyName(Form):
    version: int
    name: str


class NextPlay(Form):
    """The play to show now."""

    play: UUID
    user: str
    item: str
    slot: Annotated[int, Field(description="the slot in which it will take place")]
    title: str
    tags: list[str]
    payload: Mapping[str, object]
    like: Reward
    signals: Annotated[
        Sequence[str], Field(description="what it may be answered with, beside `none`")
    ]
    propensity: Annotated[
        Chance, Field(description="chance with which the policy chose this item")
    ]
    policy: PolicyName
    pending: Annotated[bool, Field(description="it was offered before, unanswered")]
    explanation: ExplanationView | None = None

    @classmethod
    def of(cls, offer: Offer) -> Self:
        offered = offer.plays[0]
        return cls(
            play=offered.play.id,
            user=offered.play.user,
            item=offered.shelf.id,
            slot=offer.slot,
            title=offered.shelf.title,
            tags=list(offered.shelf.tags),
            payload=offered.shelf.payload,
            like=offered.play.predicted,
            signals=offered.signals,
            propensity=offered.play.propensity or 0.0,
            policy=PolicyName(version=offer.policy.version, name=offer.policy.name),
            pending=offer.repeated,
        )


class SlatePlay(Form):
    """One of the plays of a slot, to be answered by itself."""

    play: UUID
    place: Annotated[int, Field(description="in what order they were chosen, from 0")]
    item: str
    title: str
    tags: list[str]
    payload: Mapping[str, object]
    like: Reward
    signals: Annotated[
        Sequence[str], Field(description="what it may be answered with, beside `none`")
    ]
    propensity: Annotated[
        Chance,
        Field(description="chance with which it was chosen, given those before it"),
    ]
    explanation: ExplanationView | None = None

    @classmethod
    def of(cls, offered: Offered) -> Self:
        play, shelf = offered.play, offered.shelf
        return cls(
            play=play.id,
            place=play.place,
            item=shelf.id,
            title=shelf.title,
            tags=list(shelf.tags),
            payload=shelf.payload,
            like=play.predicted,
            signals=offered.signals,
            propensity=play.propensity or 0.0,
        )


class NextSlate(NextPlay):
    """The plays to show now. What is said of one is said of the first of them."""

    plays: list[SlatePlay]


Upcoming: TypeAlias = NextPlay | NextSlate


def upcoming(offer: Offer, count: int) -> Upcoming:
    """One play, or several where several were asked for or wait."""
    first = NextPlay.of(offer)
    if count == 1 and len(offer.plays) == 1:
        return first
    plays = [SlatePlay.of(offered) for offered in offer.plays]
    return NextSlate(**dict(first), plays=plays)


class FeedbackTaken(Form):
    """What became of an answer."""

    play: UUID
    signal: str
    slot: Annotated[int, Field(description="the one after that of the play")]
    repeated: Annotated[bool, Field(description="the same answer was given before")]
    next: Upcoming | None = None

    @classmethod
    def of(cls, feedback: Feedback, count: int = 1) -> Self:
        following = feedback.next
        return cls(
            play=feedback.play.id,
            signal=feedback.signal,
            slot=feedback.slot,
            repeated=feedback.repeated,
            next=None if following is None else upcoming(following.offer, count),
        )
