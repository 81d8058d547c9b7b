"""Forms of what the guard finds."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Literal, Self

from pydantic import Field

from app.api.schemas.fields import Form
from app.services.guard_reports import Judged, Report
from app.storage.judgements import State

WITHIN = 1.96  # standard errors that hold 95 % of what chance does


class FallbackView(Form):
    """The policy that the guard falls back to."""

    name: str
    params: Mapping[str, object]


class ScoresView(Form):
    """Of the answers at the last look. Losses are mean cross entropies, in nats."""

    answers: int
    users: int
    model: Annotated[float, Field(description="loss of what the model predicted")]
    constant: Annotated[float, Field(description="of the mean of earlier answers")]
    rate: Annotated[
        float, Field(description="of the user's share of likes, shrunk to that mean")
    ]
    excess: Annotated[
        float, Field(description="the model's loss above the lower of the others")
    ]
    interval: Annotated[
        tuple[float, float], Field(description="that holds the excess in 95 of 100")
    ]
    predicted: Annotated[float, Field(description="mean reward")]
    answered: Annotated[float, Field(description="mean reward")]
    calibration_error: Annotated[
        float, Field(description="mean distance of the two in ten classes")
    ]


class JudgementView(Form):
    """How the guard judges the present version of a model."""

    model: str
    version: int
    policy: Annotated[int, Field(description="version whose plays are judged")]
    state: Annotated[
        State,
        Field(
            description="`alarm`: it predicts worse than a simple rate; `trial`: it"
            " follows a version that did"
        ),
    ]
    since: datetime
    answers: Annotated[int, Field(description="plays of this policy that count")]
    window: Annotated[int, Field(description="of them, those that are looked at")]
    fresh: Annotated[int, Field(description="of them, those since the last look")]
    streak: Annotated[
        int,
        Field(
            description="looks in a row that found it worse; below zero: that found it"
            " fit to leave its state"
        ),
    ]
    needed: Annotated[int, Field(description="looks in a row that change its state")]
    falls: Annotated[int, Field(description="policies that were replaced for it")]
    scores: Annotated[
        ScoresView | None, Field(description="null: there was no look yet")
    ]

    @classmethod
    def of(cls, judged: Judged) -> Self:
        judgement, scores = judged.judgement, judged.scores
        return cls(
            model=judgement.model,
            version=judgement.version,
            policy=judgement.policy,
            state=judgement.state,
            since=judgement.since,
            answers=judgement.answers,
            window=judged.known,
            fresh=judgement.fresh,
            streak=judgement.streak,
            needed=judged.needed,
            falls=judgement.falls,
            scores=scores
            and ScoresView(
                answers=scores.answers,
                users=scores.users,
                model=scores.model,
                constant=scores.constant,
                rate=scores.rate,
                excess=scores.excess,
                interval=(
                    scores.excess - WITHIN * scores.error,
                    scores.excess + WITHIN * scores.error,
                ),
                predicted=scores.predicted,
                answered=scores.answered,
                calibration_error=scores.calibration,
            ),
        )


class GuardView(Form):
    """The guard: what it may do, what it did, and how it judges each model."""

    mode: Literal["off", "watch", "fall_back"]
    fallback: FallbackView
    policy: Annotated[int, Field(description="version of the policy in force")]
    fallen: Annotated[bool, Field(description="whether the guard put it there")]
    instead_of: Annotated[
        int | None, Field(description="version that it would put back")
    ]
    outlook: Annotated[str, Field(description="what would happen next")]
    checked_at: Annotated[datetime | None, Field(description="null: never yet")]
    models: list[JudgementView]

    @classmethod
    def of(cls, report: Report) -> Self:
        return cls.model_validate(
            {
                "mode": report.mode,
                "fallback": FallbackView.model_validate(report.fallback),
                "policy": report.in_force.version,
                "fallen": report.instead_of is not None,
                "instead_of": report.instead_of,
                "outlook": report.outlook,
                "checked_at": report.checked_at,
                "models": [JudgementView.of(judged) for judged in report.models],
            }
        )
