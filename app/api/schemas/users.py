"""Forms of what is held about a user."""

from collections.abc import Sequence
from typing import Annotated, Self

from pydantic import BeforeValidator, Field

from app.api.schemas.fields import Form, Id, Reward, whole
from app.api.schemas.listening import AmongForm, FeedbackForm, PolicyName
from app.api.schemas.pages import NextCursor
from app.api.schemas.plays import PlayView
from app.api.schemas.policy import OptionalPolicyForm
from app.services.forecasts import Forecast
from app.services.moods import Mood
from app.services.playlists import Plan, Planned
from app.services.profiles import Holding
from app.services.timelines import Timeline

LONGEST = 200  # playlist


class ReportForm(FeedbackForm):
    """A play that the user chose alone, with its answer."""

    item: Id


class BeliefView(Form):
    """What is believed of the interest in one item, in the user's slot."""

    item: str
    model: str
    states: Sequence[str]
    belief: Annotated[Sequence[float], Field(description="probability of each state")]
    like: Reward
    rested: Annotated[
        int | None, Field(description="slots since it was played, null: untouched")
    ]


class MoodView(Form):
    """The mood of a user's next play: a class of the last answers, to any items."""

    number: Annotated[int, Field(description="of the class, in the model's order")]
    last: Annotated[
        Sequence[str], Field(description="the last answers, the latest last")
    ]
    tendency: Annotated[float, Field(description="share of likes, of late")]
    paused: Annotated[bool, Field(description="whether the play follows a pause")]


def mood_view(mood: Mood | None) -> MoodView | None:
    return None if mood is None else MoodView.model_validate(mood)


class BeliefPage(Form):
    user: str
    slot: int
    mood: Annotated[MoodView | None, Field(description="null: no model has a mood")]
    beliefs: list[BeliefView]
    next: NextCursor


class PlayPage(Form):
    plays: list[PlayView]
    next: NextCursor


class PlaylistForm(AmongForm):
    """Which plays to plan, and by which policy."""

    length: Annotated[
        int, Field(strict=True, ge=1, le=LONGEST), BeforeValidator(whole)
    ] = 20
    repeats: Annotated[
        bool, Field(strict=True, description="an item may be planned more than once")
    ] = False
    policy: Annotated[
        OptionalPolicyForm,
        Field(
            description="plans in place of the one that serves the user; it need not"
            " have been in force, and is not put there"
        ),
    ] = None


class PlannedPlay(Form):
    item: str
    title: str
    slot: int
    like: Reward
    pending: bool
    rung: Annotated[
        int | None,
        Field(description="of the policy; 0: itself, else what it fell to"),
    ]

    @classmethod
    def of(cls, planned: Planned) -> Self:
        return cls(
            item=planned.shelf.id,
            title=planned.shelf.title,
            slot=planned.slot,
            like=planned.like,
            pending=planned.pending,
            rung=planned.rung,
        )


class Playlist(Form):
    user: str
    mood: Annotated[
        MoodView | None, Field(description="in which it begins; no answer changes it")
    ]
    policy: Annotated[PolicyName, Field(description="that planned")]
    plays: list[PlannedPlay]

    @classmethod
    def of(cls, user: str, plan: Plan) -> Self:
        return cls(
            user=user,
            mood=mood_view(plan.mood),
            policy=PolicyName(version=plan.policy.version, name=plan.policy.name),
            plays=[PlannedPlay.of(play) for play in plan.plays],
        )


class ForecastPoint(Form):
    rested: Annotated[int, Field(description="further slots of rest")]
    like: Reward


class ForecastView(Form):
    """The expected reward of one item, if it rests from now on."""

    user: str
    item: str
    slot: int
    rested: Annotated[int | None, Field(description="slots rested so far")]
    like: Reward
    threshold: Annotated[float, Field(description="reward at which it counts as back")]
    back_in: Annotated[
        int | None, Field(description="slots until then; null: not in this forecast")
    ]
    mood: Annotated[
        MoodView | None, Field(description="of the user now, which is taken to last")
    ]
    slot_s: Annotated[
        float | None,
        Field(description="seconds of a slot, null: slots pass by plays alone"),
    ]
    forecast: list[ForecastPoint]

    @classmethod
    def of(cls, user: str, item: str, forecast: Forecast) -> Self:
        return cls(
            user=user,
            item=item,
            slot=forecast.slot,
            rested=forecast.rested,
            like=forecast.now,
            threshold=forecast.threshold,
            back_in=forecast.back_in,
            mood=mood_view(forecast.mood),
            slot_s=forecast.slot_s,
            forecast=[
                ForecastPoint(rested=slots, like=like)
                for slots, like in enumerate(forecast.likes, start=1)
            ],
        )


class TimelinePoint(Form):
    """What was believed of the item as a slot began."""

    slot: int
    belief: Annotated[Sequence[float], Field(description="probability of each state")]
    like: Reward
    rested: Annotated[
        int | None, Field(description="slots since it was played, null: untouched")
    ]
    signals: Annotated[
        Sequence[str],
        Field(description="answers to its plays in this slot; none: it rested"),
    ]


class TimelineView(Form):
    """How interest in one item has moved, by the models in force; the last is now."""

    user: str
    item: str
    model: str
    states: Sequence[str]
    timeline: list[TimelinePoint]

    @classmethod
    def of(cls, user: str, item: str, told: Timeline) -> Self:
        return cls(
            user=user,
            item=item,
            model=told.model,
            states=told.states,
            timeline=[TimelinePoint.model_validate(each) for each in told.moments],
        )


class UserExport(Form):
    """All that is held about a user."""

    user: str
    slot: int
    mood: MoodView | None
    beliefs: list[BeliefView]
    plays: list[PlayView]

    @classmethod
    def of(cls, held: Holding) -> Self:
        return cls(
            user=held.user.id,
            slot=held.user.slot,
            mood=mood_view(held.mood),
            beliefs=[BeliefView.model_validate(belief) for belief in held.beliefs],
            plays=[PlayView.of(play, shelf) for play, shelf in held.plays],
        )
