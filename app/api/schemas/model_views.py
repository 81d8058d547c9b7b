"""Views of item models."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Self

from pydantic import Field

from app.api.schemas.fields import Form
from app.api.schemas.pages import NextCursor
from app.domain import ItemModel, ItemMood, ItemSample, ItemSignals


class ModelMoodView(Form):
    """How the user's last answers make a mood, and what it makes of a model."""

    answers: int
    memory: float | None
    levels: Sequence[float]
    pause_s: float | None
    classes: Annotated[int, Field(description="how many moods there are")]
    like: Annotated[
        Sequence[Sequence[float]] | None,
        Field(description="chance of a like, by mood and state; null: see observe"),
    ]
    observe: Annotated[
        Sequence[Sequence[Sequence[float]]] | None,
        Field(description="chance of each signal, by mood and state; null: see like"),
    ]
    shares: Annotated[
        Sequence[float] | None,
        Field(description="how often each mood is met; null: all alike"),
    ]

    @classmethod
    def of(cls, mood: ItemMood) -> Self:
        rule = mood.rule
        return cls(
            answers=rule.answers,
            memory=rule.memory,
            levels=rule.levels,
            pause_s=rule.pause_s,
            classes=len(mood.like or mood.observe or ()),
            like=mood.like,
            observe=mood.observe,
            shares=mood.shares,
        )


class SampleMoodView(Form):
    """What the model's mood makes of a sample."""

    like: Sequence[Sequence[float]] | None
    observe: Sequence[Sequence[Sequence[float]]] | None


class SampleView(Form):
    """What a model may be as well as not."""

    play: Sequence[Sequence[float]]
    rest: Sequence[Sequence[float]]
    prior: Sequence[float]
    like: Annotated[
        Sequence[float] | None, Field(description="null: see observe, or mood")
    ]
    observe: Annotated[
        Sequence[Sequence[float]] | None, Field(description="null: see like, or mood")
    ]
    mood: Annotated[
        SampleMoodView | None, Field(description="null: the model has none")
    ]

    @classmethod
    def of(cls, sample: ItemSample, *, moody: bool) -> Self:
        told = {"like": sample.like, "observe": sample.observe}
        none = dict.fromkeys(told)
        chains = {"play": sample.play, "rest": sample.rest, "prior": sample.prior}
        return cls.model_validate(
            {**chains, **none, "mood": told}
            if moody
            else {**chains, **told, "mood": None}
        )


class ModelView(Form):
    """One version of a model; of one with a mood, `like` and `observe` are means."""

    id: str
    version: int
    states: Sequence[str]
    play: Sequence[Sequence[float]]
    rest: Sequence[Sequence[float]]
    like: Annotated[
        Sequence[float],
        Field(
            description="expected reward of a play, by state: the chance of a like"
            " where signals are skip and like"
        ),
    ]
    prior: Sequence[float]
    source: str
    signals: Annotated[
        Sequence[str], Field(description="what a play may tell, beside `none`")
    ]
    observe: Annotated[
        Sequence[Sequence[float]],
        Field(description="row i: chance of each signal in state i"),
    ]
    reward: Annotated[Sequence[float], Field(description="worth of each signal")]
    fractions: Annotated[
        Mapping[str, float] | None,
        Field(description="least share played that means a signal; null: not given"),
    ]
    mood: Annotated[
        ModelMoodView | None,
        Field(description="null: it is answered alike in all moods"),
    ]
    samples: Annotated[
        Sequence[SampleView] | None,
        Field(description="if there are any, they are what counts, not their middle"),
    ]
    created_at: datetime
    warnings: Annotated[
        Sequence[str], Field(description="allowed, but looks like a mistake")
    ]

    @classmethod
    def of(
        cls, model: ItemModel, signals: ItemSignals, warnings: Sequence[str]
    ) -> Self:
        return cls(
            id=model.id,
            version=model.version,
            states=model.states,
            play=model.play,
            rest=model.rest,
            like=model.like,
            prior=model.prior,
            source=model.source,
            signals=signals.names,
            observe=signals.observe,
            reward=signals.reward,
            fractions=signals.fractions,
            mood=None if model.mood is None else ModelMoodView.of(model.mood),
            samples=model.samples
            and [
                SampleView.of(sample, moody=model.mood is not None)
                for sample in model.samples
            ],
            created_at=model.created_at,
            warnings=warnings,
        )


class ModelPage(Form):
    """Models in order of id, each in its latest version."""

    models: list[ModelView]
    next: NextCursor
