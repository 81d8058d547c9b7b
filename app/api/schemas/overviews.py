"""Forms of how things went lately."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Self

from pydantic import Field

from app.api.schemas.experiments import EstimateView
from app.api.schemas.fields import Form
from app.services.overviews import Bucket, Course, Overview


class BucketView(Form):
    """Plays that were chosen within a span of time."""

    at: Annotated[datetime, Field(description="when the span began")]
    plays: int
    answered: int
    likes: Annotated[float, Field(description="rewards of what was answered")]
    expected: Annotated[float, Field(description="rewards that were predicted for it")]


class CourseView(Form):
    """What the plays of one policy came to."""

    version: Annotated[
        int | None, Field(description="null: plays that users chose alone")
    ]
    name: str | None
    users: int
    plays: int
    answered: int
    likes: float
    expected: float
    like_rate: Annotated[
        EstimateView | None, Field(description="plays of a user count as one cluster")
    ]
    buckets: Annotated[Sequence[BucketView], Field(description="but for empty ones")]

    @classmethod
    def of(cls, version: int | None, course: Course, told: Overview) -> Self:
        policy = None if version is None else told.policies[version]
        start = told.until - told.span
        return cls(
            version=version,
            name=policy and policy.name,
            users=len(course.users),
            **_counts(course.total),
            like_rate=EstimateView.of(course.rate),
            buckets=[
                BucketView(at=start + number * told.bucket, **_counts(bucket))
                for number, bucket in sorted(course.buckets.items())
            ],
        )


class OverviewView(Form):
    """The latest plays, by policy and time."""

    since: Annotated[
        datetime,
        Field(description="of earlier plays there were too many to look at them all"),
    ]
    until: datetime
    bucket_s: float
    policies: list[CourseView]

    @classmethod
    def of(cls, told: Overview) -> Self:
        versions = sorted(told.courses, key=lambda version: version or 0)
        return cls(
            since=told.since,
            until=told.until,
            bucket_s=told.bucket.total_seconds(),
            policies=[CourseView.of(one, told.courses[one], told) for one in versions],
        )


def _counts(bucket: Bucket) -> dict[str, float]:
    return {
        "plays": bucket.plays,
        "answered": bucket.answered,
        "likes": bucket.likes,
        "expected": bucket.expected,
    }
