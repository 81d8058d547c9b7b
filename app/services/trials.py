"""Policies tried on simulated users of a catalogue, each of whom is new to it."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from app.services.entrants import Entrant
from app.services.openings import Opening
from policies import MOST_DISCOUNT, Bound
from simulation import (
    Course,
    Value,
    contenders,
    remainder,
    seconds,
    slots_of,
    standard_error,
    value,
)

Progress = Callable[[float], object]
NORMAL = 1.96  # standard errors on either side of a mean


def course(runs: int, slots: int | None, discount: float, seed: int) -> Course:
    """As many slots as count at the discount, unless told.

    Raises:
        ValueError: names the field at fault.
    """
    if not 0 <= discount <= MOST_DISCOUNT:
        raise ValueError(f"discount: must be from 0 to {MOST_DISCOUNT}, not {discount}")
    return Course(runs, slots_of(discount) if slots is None else slots, discount, seed)


def expected_seconds(
    entrants: Sequence[Entrant], opening: Opening, course: Course
) -> float:
    """Roughly what a trial takes."""
    policies = [each.policy for each in entrants]
    alone = seconds(policies, opening.situation, course)
    return alone / (os.cpu_count() or 1)


@dataclass(frozen=True, slots=True)
class Tried:
    """What a policy earned, in discounted rewards.

    ci95:        half the width of a 95 % interval of the mean
    difference:  to the first policy, on the same random numbers
    gap:         from the mean up to the bound
    play_shares: of all plays, by model
    """

    label: str
    name: str
    params: Mapping[str, object]
    mean: float
    ci95: float
    difference: float
    difference_ci95: float
    gap: float
    gap_percent: float
    play_shares: Sequence[float]
    decision_us: float


@dataclass(frozen=True, slots=True)
class Trial:
    """Policies, each tried on the same simulated users.

    start:     hidden states follow the belief about a new user
    remainder: at most so much is earned on average after the last slot, and left out
    items:     by model, as play shares are
    bound:     what no policy exceeds on average; found at a price of rest
    """

    start: str
    discount: float
    runs: int
    slots: int
    seed: int
    remainder: float
    models: Sequence[str]
    items: Sequence[int]
    depth: int
    bound: float
    price: float
    policies: Sequence[Tried]


def tried(
    entrants: Sequence[Entrant],
    opening: Opening,
    course: Course,
    preparing: Progress,
    playing: Progress,
) -> Sequence[Value]:
    """What each policy earns."""
    policies = [each.policy for each in entrants]
    models = opening.situation.models
    ready = contenders(policies, models, progress=preparing)
    return value(ready, opening.situation, course, progress=playing)


def reported(
    entrants: Sequence[Entrant],
    opening: Opening,
    course: Course,
    depth: int,
    most: Bound,
    values: Sequence[Value],
) -> Trial:
    """All of it, for programs."""
    return Trial(
        start="belief",
        discount=course.discount,
        runs=course.runs,
        slots=course.slots,
        seed=course.seed,
        remainder=remainder(opening.situation, course),
        models=opening.models,
        items=opening.items,
        depth=depth,
        bound=most.value,
        price=most.price,
        policies=[
            _tried(entrant, value, most.value)
            for entrant, value in zip(entrants, values, strict=True)
        ],
    )


def _tried(entrant: Entrant, value: Value, bound: float) -> Tried:
    gap = bound - value.mean
    return Tried(
        label=entrant.label,
        name=entrant.name,
        params=entrant.params,
        mean=value.mean,
        ci95=NORMAL * value.error,
        difference=float(value.difference.mean()),
        difference_ci95=NORMAL * standard_error(value.difference),
        gap=gap,
        gap_percent=100 * gap / bound if bound > 0 else 0.0,
        play_shares=value.shares.tolist(),
        decision_us=value.decision_us,
    )
