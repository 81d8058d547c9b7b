"""Forms of item models."""

import re
from typing import Annotated

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    StringConstraints,
)

from app.api.schemas.chains import (
    MOST_SIGNALS,
    MOST_STATES,
    BySignal,
    Like,
    LikeInMoods,
    Observe,
    ObserveInMoods,
    Play,
    Prior,
    Probability,
    Rest,
)
from app.api.schemas.fields import (
    WORDS,
    Chance,
    Form,
    Note,
    SignalName,
    storable,
    whole,
)
from app.domain import ItemMood, ItemSample, MoodRule
from app.services.new_models import NewModel

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
        BeforeValidator(whole),
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
    like: LikeInMoods = None
    observe: ObserveInMoods = None
    shares: Annotated[
        list[Probability] | None,
        Field(min_length=1, description="how often each mood is met; null: all alike"),
    ] = None

    def mood(self) -> ItemMood:
        rule = MoodRule(self.answers, self.memory, self.levels, self.pause_s)
        return ItemMood(rule, self.like, self.observe, self.shares)


class SampleMoodForm(Form):
    """What the user's mood, which is the model's, makes of a sample."""

    like: LikeInMoods = None
    observe: ObserveInMoods = None


class SampleForm(Form):
    """What the model may be as well as not: of the same states, signals and mood."""

    play: Play
    rest: Rest
    prior: Prior
    like: Like = None
    observe: Observe = None
    mood: SampleMoodForm | None = None

    def sample(self) -> ItemSample:
        told: SampleForm | SampleMoodForm = self if self.mood is None else self.mood
        return ItemSample(self.play, self.rest, self.prior, told.like, told.observe)


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
    play: Play
    rest: Rest
    like: Like = None
    prior: Prior
    source: Annotated[Note, Field(description="where these numbers come from")] = ""
    signals: Annotated[
        list[SignalName] | None,
        Field(
            min_length=1,
            max_length=MOST_SIGNALS,
            description="names of what a play may tell; none of them is `none`",
        ),
    ] = None
    observe: Observe = None
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
    samples: Annotated[
        list[SampleForm] | None,
        Field(
            min_length=1,
            max_length=MOST_STATES // 2,
            description="draws from what is known of the model: if there are any, they"
            " are what counts, all alike at first; of at most 64 states in all",
        ),
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
            None if self.samples is None else [each.sample() for each in self.samples],
        )
