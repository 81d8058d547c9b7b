"""Fields of a chain of interest."""

from typing import Annotated

from pydantic import Field

MOST_STATES = 64
MOST_SIGNALS = 32

Probability = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=0, le=1 + 1e-6)
]
Vector = Annotated[list[Probability], Field(min_length=2, max_length=MOST_STATES)]
Matrix = Annotated[list[Vector], Field(min_length=2, max_length=MOST_STATES)]
BySignal = Annotated[list[Probability], Field(min_length=1, max_length=MOST_SIGNALS)]
BySignals = Annotated[list[BySignal], Field(min_length=2, max_length=MOST_STATES)]
Play = Annotated[
    Matrix, Field(description="row i: where state i moves when the item is played")
]
Rest = Annotated[
    Matrix, Field(description="row i: where state i moves when another item is played")
]
Like = Annotated[Vector | None, Field(description="chance of a like, by state")]
Prior = Annotated[Vector, Field(description="belief about a new user")]
Observe = Annotated[
    BySignals | None, Field(description="row i: chance of each signal in state i")
]
LikeInMoods = Annotated[
    list[Vector] | None,
    Field(min_length=1, description="chance of a like, by mood and state"),
]
ObserveInMoods = Annotated[
    list[BySignals] | None,
    Field(min_length=1, description="chance of each signal, by mood and state"),
]
