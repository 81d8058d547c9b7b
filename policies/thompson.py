"""Act as if one draw from the posterior over models were the truth.

Thompson (1933), "On the likelihood that one unknown probability exceeds another"; for
restless bandits with hidden states, Jiang and others (2023), "Online restless
bandits with unobserved states". The draws are the models' samples. A policy that plans
on the models themselves weighs the samples and what it may learn of them; this one
learns by trying what might be the best.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from policies.arrays import Ints
from policies.choice import Mixture, mixed
from policies.exact_rollout import ExactRollout
from policies.layers import Layers, stacked
from policies.model_set import ModelSet
from policies.parameters import check
from policies.policy import Policy, Scorer
from policies.samples import conditioned
from policies.situation import Situation, Slate
from policies.tables import Tables


@dataclass(frozen=True, slots=True)
class Thompson:
    """Follows another policy, as if one sample of each model, drawn anew, were true.

    Samples are drawn together: number k of every model, or k modulo their number. All
    numbers have the same chance, whatever one user's answers say of them: samples come
    from a log that holds those answers, which would else count twice. What is believed
    of an item in the sample drawn is exact. Without samples, this is the policy
    followed.

    Attributes:
        policy: the policy followed.
    """

    policy: Annotated[Policy, "policy followed on the models drawn"] = field(
        default_factory=ExactRollout
    )

    def __post_init__(self) -> None:
        check(self)

    @property
    def rest_matters(self) -> bool:
        """Whether it does to the policy followed."""
        return self.policy.rest_matters

    @property
    def is_index(self) -> bool:
        """Whether the policy followed is one."""
        return self.policy.is_index

    @property
    def table_discount(self) -> float | None:
        """That of the policy followed."""
        return self.policy.table_discount

    def prepare(self, models: ModelSet, tables: Tables) -> Scorer:
        """Prepare the policy followed for the models of each draw.

        Args:
            models: M models.
            tables: of `models.separated()`.
        """
        draws = int(models.samples.max(initial=1))
        if draws == 1:
            return self.policy.prepare(models, tables)
        first = np.cumsum(models.samples) - models.samples
        drawn = [models.drawn(k) for k in range(draws)]
        scorers = [
            self.policy.prepare(each, _of_rows(tables, first + k % models.samples))
            for k, each in enumerate(drawn)
        ]

        def scores(situation: Situation, seed: int) -> Mixture:
            parts = [
                scorer(imagined, seed)
                for scorer, imagined in zip(
                    scorers, _imagined(situation, drawn), strict=True
                )
            ]
            return mixed([1 / draws] * draws, parts)

        return scores

    def cost(self, situation: Situation) -> float:
        """Estimate the microseconds of one call."""
        draws = int(situation.models.samples.max(initial=1))
        own = 3.0 + 0.015 * len(situation.model)
        return draws * (own + self.policy.cost(situation))


def draws_samples(policy: Policy) -> bool:
    """Return whether a policy looks at each sample of a model by itself.

    Such a one can use tables of the samples; a policy that looks at all of them
    together needs one table for all, and there is none.
    """
    followed = getattr(policy, "policy", None)
    if isinstance(policy, Thompson) or not isinstance(followed, Policy):
        return isinstance(policy, Thompson)
    return draws_samples(followed)


def _imagined(situation: Situation, drawn: Sequence[ModelSet]) -> Iterator[Situation]:
    """Yield what the situation is if each of some draws is the truth."""
    slate, states = situation.slate, drawn[0].like.shape[1]
    beliefs, chosen = (
        conditioned(situation.models, model, belief, len(drawn), states)
        for model, belief in (
            (situation.model, situation.belief),
            (slate.model, slate.belief),
        )
    )
    for models, belief, rest in zip(drawn, beliefs, chosen, strict=True):
        yield Situation(
            models,
            situation.model,
            belief,
            situation.count,
            situation.rested,
            Slate(slate.plays, slate.model, rest),
            situation.mood,
            situation.resumed,
        )


def _of_rows(tables: Tables, rows: Ints) -> Tables:
    """Return the tables of some rows; none if there are none."""
    if len(tables.low) == 0:
        return tables
    return tables._replace(
        whittle=_layers_of_rows(tables.whittle, rows),
        value=_layers_of_rows(tables.value, rows),
        low=tables.low[rows],
        high=tables.high[rows],
    )


def _layers_of_rows(layers: Layers, rows: Ints) -> Layers:
    count = len(layers.values) // int(layers.size.sum())
    values = [
        layers.values[start : start + count * size].reshape(count, size)
        for start, size in zip(layers.start[rows], layers.size[rows], strict=True)
    ]
    return stacked(
        layers.states[rows].tolist(), layers.divisions[rows].tolist(), values
    )
