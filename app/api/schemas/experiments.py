"""Forms of experiments, and of what they show."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Self

from pydantic import Field, StringConstraints

from app.api.schemas.fields import Form, Note
from app.api.schemas.pages import NextCursor
from app.api.schemas.policy import AnyPolicyForm, OptionalPolicyForm
from app.domain import Experiment, PolicyVersion
from app.services.experiment_reports import ArmReport, Report, ShadowReport
from app.services.new_experiments import NewArm, NewExperiment, NewShadow
from learning.sequential import Difference, Estimate

MOST_ARMS = 20
MOST_SHADOWS = 5
Name = Annotated[
    str,
    StringConstraints(
        strict=True, max_length=64, pattern=r"^[a-z0-9]([a-z0-9_-]*[a-z0-9])?$"
    ),
    Field(description="lower-case letters and digits, - and _ between them"),
]
Share = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]


class ArmForm(Form):
    """Users who are served by one policy."""

    name: Name
    policy: Annotated[
        OptionalPolicyForm, Field(description="null: whichever is in force")
    ] = None
    share: Annotated[Share, Field(description="of all users")]

    def arm(self) -> NewArm:
        note = "" if self.policy is None else self.policy.note
        described = None if self.policy is None else self.policy.described()
        return NewArm(self.name, described, self.share, note)


class ShadowForm(Form):
    """A policy that decides, too, and is not served."""

    name: Name
    policy: AnyPolicyForm
    sample: Annotated[Share, Field(gt=0, description="share of plays it decides")] = 0.1

    def shadow(self) -> NewShadow:
        described = self.policy.described()
        return NewShadow(self.name, described, self.sample, self.policy.note)


class ExperimentForm(Form):
    """How to split users; shares and holdout add up to 1."""

    name: Name
    arms: Annotated[list[ArmForm], Field(max_length=MOST_ARMS)] = Field(
        default_factory=list
    )
    holdout: Annotated[Share, Field(description="share of users who are in no arm")] = (
        0.0
    )
    control: Annotated[
        Name | None,
        Field(description="arm that others are compared with; the first, if left out"),
    ] = None
    shadows: Annotated[list[ShadowForm], Field(max_length=MOST_SHADOWS)] = Field(
        default_factory=list
    )
    note: Note = ""

    def experiment(self) -> NewExperiment:
        return NewExperiment(
            self.name,
            [arm.arm() for arm in self.arms],
            self.holdout,
            self.control,
            [shadow.shadow() for shadow in self.shadows],
            self.note,
        )


class VersionView(Form):
    """A policy of an experiment, as a version among all others."""

    version: int
    name: str
    params: Mapping[str, object]

    @classmethod
    def of(cls, policy: PolicyVersion) -> Self:
        return cls(version=policy.version, name=policy.name, params=policy.params)


class EstimateView(Form):
    """A value, and the interval that holds it in 95 of 100, for one look."""

    value: float
    interval: tuple[float, float]

    @classmethod
    def of(cls, estimate: Estimate | None) -> Self | None:
        if estimate is None:
            return None
        return cls(value=estimate.value, interval=(estimate.low, estimate.high))


class DifferenceView(Form):
    """The mean like rate of an arm's users, less that of the control's."""

    value: float
    interval: Annotated[
        tuple[float, float],
        Field(description="holds it at all times together, but for `level` of cases"),
    ]
    level: float
    p: Annotated[
        float,
        Field(
            description="always valid, and for all arms together: below 0.05 they"
            " differ, at whatever time one looks"
        ),
    ]

    @classmethod
    def of(cls, difference: Difference | None) -> Self | None:
        if difference is None:
            return None
        return cls(
            value=difference.value,
            interval=(difference.low, difference.high),
            level=difference.level,
            p=difference.p,
        )


class ArmView(Form):
    """What the users of an arm did."""

    name: str
    policy: Annotated[
        VersionView | None, Field(description="null: whichever is in force")
    ]
    share: float
    users: Annotated[int, Field(description="who were offered anything")]
    plays: int
    answered: int
    likes: Annotated[float, Field(description="rewards of what was answered")]
    like_rate: Annotated[
        EstimateView | None, Field(description="plays of a user count as one cluster")
    ]
    difference: Annotated[
        DifferenceView | None,
        Field(description="to the control; null: it is it, or too few have answered"),
    ]
    moved: Annotated[
        int, Field(description="plays of users who were in another arm before")
    ]

    @classmethod
    def of(cls, arm: ArmReport) -> Self:
        return cls(
            name=arm.name,
            policy=arm.policy and VersionView.of(arm.policy),
            share=arm.share,
            users=arm.users,
            plays=arm.plays,
            answered=arm.answered,
            likes=arm.likes,
            like_rate=EstimateView.of(arm.rate),
            difference=DifferenceView.of(arm.difference),
            moved=arm.moved,
        )


class ShadowView(Form):
    """What a policy would have chosen that was not served."""

    name: str
    policy: VersionView
    sample: float
    decisions: int
    agreement: Annotated[
        EstimateView | None,
        Field(description="share of decisions for what was served, or its equal"),
    ]
    gain: Annotated[
        EstimateView | None,
        Field(
            description="likes in this play that the models expect of its choice, less"
            " those of what was served: not what it would earn in the long run"
        ),
    ]

    @classmethod
    def of(cls, shadow: ShadowReport) -> Self:
        return cls(
            name=shadow.name,
            policy=VersionView.of(shadow.policy),
            sample=shadow.sample,
            decisions=shadow.decisions,
            agreement=EstimateView.of(shadow.agreement),
            gain=EstimateView.of(shadow.gain),
        )


class ExperimentVersion(Form):
    """One version of an experiment: it began, or its shares were changed."""

    version: int
    name: str
    origin: Annotated[int, Field(description="the version with which it began")]
    control: str | None
    holdout: float
    shares: Mapping[str, float]
    note: str
    started_at: datetime
    by: str
    ended_at: Annotated[datetime | None, Field(description="null: it runs")]
    ended_by: str | None
    ended_note: str | None

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        return cls(**_version(experiment))


class ExperimentPage(Form):
    """Versions of experiments, the latest first."""

    experiments: list[ExperimentVersion]
    next: NextCursor


class ExperimentView(ExperimentVersion):
    """An experiment, and what it has shown."""

    running: bool
    suspended: Annotated[
        bool, Field(description="the guard's fallback serves all users")
    ]
    arms: list[ArmView]
    shadows: list[ShadowView]
    counted_until: Annotated[
        datetime | None, Field(description="plays chosen before are all counted")
    ]
    warnings: Sequence[str]

    @classmethod
    def of_report(cls, report: Report) -> Self:
        return cls(
            **_version(report.experiment),
            running=report.running,
            suspended=report.suspended,
            arms=[ArmView.of(arm) for arm in report.arms],
            shadows=[ShadowView.of(shadow) for shadow in report.shadows],
            counted_until=report.counted_until,
            warnings=report.warnings,
        )


def _version(experiment: Experiment) -> dict[str, object]:
    return {
        "version": experiment.version,
        "name": experiment.name,
        "origin": experiment.origin,
        "control": experiment.control,
        "holdout": experiment.holdout,
        "shares": {arm.name: arm.share for arm in experiment.arms},
        "note": experiment.note,
        "started_at": experiment.at,
        "by": experiment.by,
        "ended_at": experiment.ended_at,
        "ended_by": experiment.ended_by,
        "ended_note": experiment.ended_note,
    }
