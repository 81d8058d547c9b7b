"""Forms of simulations, and of what they tell meanwhile."""

from collections.abc import Mapping
from typing import Annotated, Self

from pydantic import BeforeValidator, Field

from app.api.schemas.fields import Form, whole
from app.api.schemas.policy import AnyPolicyForm
from app.services.index_reports import MOST_DISCOUNT
from app.services.simulations import Simulated, Stage, Step, Wanted
from app.services.trials import Start, Tried

MOST_POLICIES = 12
Example = Annotated[int, Field(strict=True, ge=1, le=4), BeforeValidator(whole)]
Runs = Annotated[int, Field(strict=True, ge=2, le=10_000_000), BeforeValidator(whole)]
Slots = Annotated[int, Field(strict=True, ge=1, le=1_000_000), BeforeValidator(whole)]
Seed = Annotated[int, Field(strict=True, ge=0, lt=2**53), BeforeValidator(whole)]
Depth = Annotated[int, Field(strict=True, ge=0, le=2), BeforeValidator(whole)]


class SimulationForm(Form):
    """Policies to try on simulated users, each of whom is new to the items."""

    example: Annotated[
        Example | None,
        Field(
            description="of the paper, the fourth drawn by the seed; left out: the"
            " present catalogue, and before the others the policy in force",
        ),
    ] = None
    policies: Annotated[
        list[AnyPolicyForm],
        Field(
            min_length=1,
            max_length=MOST_POLICIES,
            description="each plans at `discount`, unless its parameters say otherwise",
        ),
    ]
    start: Annotated[
        Start,
        Field(description="hidden states follow the beliefs, or are the paper's"),
    ] = Start.BELIEF
    runs: Annotated[Runs, Field(description="simulated users")] = 500
    slots: Annotated[
        Slots | None,
        Field(
            description="plays of each; left out: until a reward counts less than a ten"
            " thousandth",
        ),
    ] = None
    discount: Annotated[
        float, Field(strict=True, ge=0, le=MOST_DISCOUNT, allow_inf_nan=False)
    ] = 0.95
    seed: Annotated[Seed, Field(description="the same seed gives the same numbers")] = 1
    depth: Annotated[Depth, Field(description="plays of look-ahead of the bound")] = 1

    def wanted(self) -> Wanted:
        return Wanted(
            self.example,
            [policy.described() for policy in self.policies],
            self.start,
            self.runs,
            self.slots,
            self.discount,
            self.seed,
            self.depth,
        )


class TriedView(Form):
    """What a policy earned, in discounted rewards."""

    label: Annotated[str, Field(description="what tells it from the others")]
    name: str
    params: Mapping[str, object]
    mean: float
    ci95: Annotated[float, Field(description="half the width of a 95 % interval")]
    difference: Annotated[
        float, Field(description="to the first policy, on the same random numbers")
    ]
    difference_ci95: float
    gap: Annotated[float | None, Field(description="from the mean up to the bound")]
    gap_percent: Annotated[float | None, Field(description="of the bound")]
    play_shares: Annotated[
        list[float], Field(description="of all plays, in the order of `models`")
    ]
    decision_us: Annotated[float, Field(description="median time of a decision")]
    curve: Annotated[
        list[float],
        Field(description="mean earned by the end of each slot of `slots_shown`"),
    ]
    curve_error: Annotated[list[float], Field(description="its standard error")]


class SimulationView(Form):
    """What policies earn, and what none exceeds."""

    discount: float
    runs: int
    slots: int
    seed: int
    start: Start
    models: Annotated[list[str], Field(description="a group of items each")]
    items: Annotated[list[int], Field(description="how many there are of each model")]
    remainder: Annotated[
        float,
        Field(description="at most so much is earned on average after the last slot"),
    ]
    bound: Annotated[
        float | None,
        Field(description="what no policy exceeds on average; null: see `reason`"),
    ]
    reason: str | None
    slots_shown: list[int]
    policies: list[TriedView]

    @classmethod
    def of(cls, simulated: Simulated) -> Self:
        trial = simulated.trial
        curves = zip(trial.policies, simulated.curves, simulated.errors, strict=True)
        return cls(
            discount=trial.discount,
            runs=trial.runs,
            slots=trial.slots,
            seed=trial.seed,
            start=trial.start,
            models=list(trial.models),
            items=list(trial.items),
            remainder=trial.remainder,
            bound=trial.bound,
            reason=simulated.reason,
            slots_shown=list(simulated.slots),
            policies=[
                _tried(tried, curve.tolist(), error.tolist())
                for tried, curve, error in curves
            ],
        )


class SimulationLine(Form):
    """One line: how far it is, or, in the last one, what came of it."""

    stage: Stage | None = None
    share: Annotated[
        float | None, Field(ge=0, le=1, description="of this stage that is done")
    ] = None
    result: SimulationView | None = None

    @classmethod
    def of(cls, told: Step | Simulated) -> Self:
        if isinstance(told, Step):
            return cls(stage=told.stage, share=told.share)
        return cls(result=SimulationView.of(told))


def _tried(tried: Tried, curve: list[float], error: list[float]) -> TriedView:
    return TriedView(
        label=tried.label,
        name=tried.name,
        params=tried.params,
        mean=tried.mean,
        ci95=tried.ci95,
        difference=tried.difference,
        difference_ci95=tried.difference_ci95,
        gap=tried.gap,
        gap_percent=tried.gap_percent,
        play_shares=list(tried.play_shares),
        decision_us=tried.decision_us,
        curve=curve,
        curve_error=error,
    )
