"""Forms of item models."""

import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Self

from pydantic import AfterValidator, ConfigDict, Field, JsonValue, StringConstraints

from app.api.schemas.fields import WORDS, Chance, Form, Note, SignalName, storable
from app.api.schemas.pages import NextCursor
from app.domain import ItemModel, ItemMood, ItemSignals, MoodRule
from app.services.new_models import NewModel

MOST_STATES = 64
MOST_SIGNALS = 32
MOST_ANSWERS = 4
MOST_LEVELS = 16
NAME = re.compile(WORDS)


def _named(text: str) -> str:
    if not NAME.fullmatch(text):
        raise ValueError("must be words of visible characters")
    return storable(text)


StateName = Annotated[
    str,
    StringConstraints(strict=True, min_length=1, max_length=64),
    AfterValidator(_named),
    Field(json_schema_extra={"pattern": WORDS}),
]
Probability = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=0, le=1 + 1e-6)
]
Vector = Annotated[list[Probability], Field(min_length=2, max_length=MOST_STATES)]
Matrix = Annotated[list[Vector], Field(min_length=2, max_length=MOST_STATES)]
BySignal = Annotated[list[Probability], Field(min_length=1, max_length=MOST_SIGNALS)]
OWN = ("signals", "observe", "reward")
GIVEN = (
    (("like",), (*OWN, "fractions", "mood")),
    (OWN, ("like", "mood")),
    (("mood",), ("like", *OWN, "fractions")),
    (("mood", "signals", "reward"), ("like", "observe")),
)
LIKE_OR_SIGNALS: list[JsonValue] = [
    {
        "title": " and ".join(given),
        "required": [*given],
        "properties": {
            **{name: {"not": {"type": "null"}} for name in given},
            **{name: {"type": "null"} for name in left},
        },
    }
    for given, left in GIVEN
]
CHAINS: dict[str, JsonValue] = {
    "states": ["low", "high"],
    "play": [[0.9, 0.1], [0.4, 0.6]],
    "rest": [[0.7, 0.3], [0.1, 0.9]],
    "prior": [0.5, 0.5],
}
EXAMPLES: list[JsonValue] = [
    {**CHAINS, "like": [0.2, 0.9]},
    {
        **CHAINS,
        "signals": ["skip", "partial", "complete"],
        "observe": [[0.7, 0.2, 0.1], [0.1, 0.2, 0.7]],
        "reward": [0, 0.4, 1],
        "fractions": {"skip": 0, "partial": 0.2, "complete": 0.9},
    },
    {
        **CHAINS,
        "mood": {
            "answers": 1,
            "memory": None,
            "levels": [],
            "pause_s": None,
            "like": [[0.2, 0.9], [0.1, 0.7], [0.4, 0.95]],
        },
    },
]


class MoodForm(Form):
    """How the user's last answers, to any items, make a mood; and what it changes.

    Without signals `like` is needed, else `observe`.
    """

    answers: Annotated[
        int,
        Field(
            strict=True,
            ge=0,
            le=MOST_ANSWERS,
            description="of the last answers, how many are told apart",
        ),
    ]
    memory: Annotated[
        float | None,
        Field(
            strict=True,
            allow_inf_nan=False,
            ge=1,
            description="answers that the tendency goes back over; null: all, alike",
        ),
    ]
    levels: Annotated[
        list[Annotated[float, Field(strict=True, gt=0, lt=1)]],
        Field(
            max_length=MOST_LEVELS,
            description="bounds between classes of the tendency, ascending",
        ),
    ]
    pause_s: Annotated[
        float | None,
        Field(
            strict=True,
            allow_inf_nan=False,
            gt=0,
            description="seconds after which a play has a mood of its own; null: none",
        ),
    ]
    like: Annotated[
        list[Vector] | None,
        Field(min_length=1, description="chance of a like, by mood and state"),
    ] = None
    observe: Annotated[
        list[Annotated[list[BySignal], Field(min_length=2, max_length=MOST_STATES)]]
        | None,
        Field(min_length=1, description="chance of each signal, by mood and state"),
    ] = None
    shares: Annotated[
        list[Probability] | None,
        Field(min_length=1, description="how often each mood is met; null: all alike"),
    ] = None

    def mood(self) -> ItemMood:
        rule = MoodRule(self.answers, self.memory, self.levels, self.pause_s)
        return ItemMood(rule, self.like, self.observe, self.shares)


class ModelForm(Form):
    """How interest in an item moves, state to state, and how it is answered.

    A play tells a skip or a like, then `like` is needed; or it tells one of the
    `signals` that the model names, then `observe` and `reward` are needed. Where the
    answer also depends on the user's `mood`, that gives `like` or `observe`.
    """

    model_config = ConfigDict(
        json_schema_extra={"oneOf": LIKE_OR_SIGNALS, "examples": EXAMPLES}
    )

    states: Annotated[
        list[StateName],
        Field(
            min_length=2,
            max_length=MOST_STATES,
            description="names of the hidden states of interest",
        ),
    ]
    play: Annotated[
        Matrix, Field(description="row i: where state i moves when the item is played")
    ]
    rest: Annotated[
        Matrix,
        Field(description="row i: where state i moves when another item is played"),
    ]
    like: Annotated[Vector | None, Field(description="chance of a like, by state")] = (
        None
    )
    prior: Annotated[Vector, Field(description="belief about a new user")]
    source: Annotated[Note, Field(description="where these numbers come from")] = ""
    signals: Annotated[
        list[SignalName] | None,
        Field(
            min_length=1,
            max_length=MOST_SIGNALS,
            description="names of what a play may tell; none of them is `none`",
        ),
    ] = None
    observe: Annotated[
        list[BySignal] | None,
        Field(
            min_length=2,
            max_length=MOST_STATES,
            description="row i: chance of each signal in state i",
        ),
    ] = None
    reward: Annotated[BySignal | None, Field(description="worth of each signal")] = None
    fractions: Annotated[
        dict[SignalName, Annotated[Chance, Field(strict=True)]] | None,
        Field(
            min_length=1,
            max_length=MOST_SIGNALS,
            description="least share played that means a signal, by its name",
        ),
    ] = None

    mood: Annotated[
        MoodForm | None,
        Field(description="one and the same for all models that have one"),
    ] = None

    def model(self, model_id: str) -> NewModel:
        return NewModel(
            model_id,
            self.states,
            self.play,
            self.rest,
            self.like,
            self.prior,
            self.source,
            self.signals,
            self.observe,
            self.reward,
            self.fractions,
            None if self.mood is None else self.mood.mood(),
        )


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
            created_at=model.created_at,
            warnings=warnings,
        )


class ModelPage(Form):
    """Models in order of id, each in its latest version."""

    models: list[ModelView]
    next: NextCursor
