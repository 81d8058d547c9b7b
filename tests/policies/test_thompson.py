"""One draw of all models, taken for the truth."""

import dataclasses
from collections import Counter
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    Floats,
    Mixture,
    ModelSet,
    Policy,
    Scorer,
    Situation,
    Slate,
    Tables,
    build_all,
    choose,
    create,
    ready,
)
from policies.best_fixed import BestFixed
from policies.epsilon import Epsilon
from policies.myopic import Myopic
from policies.rollout import Rollout
from policies.round_robin import RoundRobin
from policies.thompson import Thompson
from tests.policies.instances import (
    Instance,
    instances,
    paper_situation,
    random_models,
    situation,
    uncertain,
)

SEEDS = st.integers(0, 2**63 - 1)


def uncertain_situation(seed: int, groups: int = 6) -> Situation:
    """Groups of a certain model, one of two samples, and one of four."""
    models = ModelSet.of(
        [*random_models(seed, [4]), uncertain(seed, 2), uncertain(seed + 1, 4, 2)]
    )
    rng = np.random.default_rng(seed)
    rows = rng.integers(0, 3, groups)
    belief = np.zeros((groups, models.like.shape[1]))
    for row, m in zip(belief, rows, strict=True):
        row[: models.states[m]] = rng.dirichlet(np.ones(models.states[m]))
    return situation(models, rows.tolist(), belief, rng.integers(1, 4, groups).tolist())


def in_sample(models: ModelSet, m: int, belief: Floats, k: int) -> Floats:
    """Return the belief about the state in sample k."""
    size = int(models.states[m] // models.samples[m])
    first = k % int(models.samples[m]) * size
    found = np.zeros(4)
    found[:size] = belief[first : first + size] / belief[first : first + size].sum()
    return found


@pytest.mark.parametrize("policy", [Myopic(), BestFixed(), Rollout(horizon=2)])
def test_each_row_is_the_policy_followed_on_one_draw(policy: Policy) -> None:
    case = uncertain_situation(1)

    mixture = ready(Thompson(policy), case.models)(case, 5)

    assert isinstance(mixture, Mixture)
    assert mixture.weight.tolist() == [0.25] * 4
    for k in range(4):
        drawn = case.models.drawn(k)
        rows = zip(case.model.tolist(), case.belief, strict=True)
        belief = np.stack([in_sample(case.models, m, b, k) for m, b in rows])
        then = dataclasses.replace(case, models=drawn, belief=belief)
        expected = ready(policy, drawn)(then, 5)
        assert not isinstance(expected, Mixture)
        assert_allclose(mixture.scores[k], expected, atol=1e-12)


def test_propensities_are_what_counting_finds() -> None:
    case = uncertain_situation(4, groups=8)
    scorer = ready(Thompson(Myopic()), case.models)
    draws = 20_000

    choices = [choose(scorer(case, seed), case.count, seed) for seed in range(draws)]

    chance = {(c.group, c.member): c.propensity for c in choices}
    assert len({choice.group for choice in choices}) > 1
    assert sum(chance.values()) == pytest.approx(1)
    for item, times in Counter((c.group, c.member) for c in choices).items():
        spread = np.sqrt(draws * chance[item] * (1 - chance[item]))
        assert abs(times - draws * chance[item]) <= 4.5 * spread


@settings(deadline=None, max_examples=30)
@given(instances(), SEEDS)
def test_without_samples_it_is_the_policy_followed(
    instance: Instance, seed: int
) -> None:
    case = instance.situation

    for policy in (Myopic(), Rollout(horizon=2, trajectories=10)):
        scores = ready(Thompson(policy), case.models)(case, seed)
        assert_array_equal(scores, ready(policy, case.models)(case, seed))


def test_a_single_sample_is_the_model() -> None:
    model = uncertain(3, 1)
    one, sample = ModelSet.of([model]), ModelSet.of([model.samples[0]])

    scores = [
        ready(Thompson(), models)(situation(models, [0], models.prior, [1]), 1)
        for models in (one, sample)
    ]

    assert_array_equal(scores[0], scores[1])


@dataclass(frozen=True)
class Watching:
    """Notes what it is given; its scores are a mixture."""

    rest_matters: ClassVar[bool] = True
    is_index: ClassVar[bool] = False
    table_discount: ClassVar[float] = 0.5

    given: list[tuple[ModelSet, Tables]] = field(default_factory=list)
    met: list[Situation] = field(default_factory=list)

    def prepare(self, models: ModelSet, tables: Tables) -> Scorer:
        self.given.append((models, tables))

        def scores(case: Situation, _seed: int) -> Mixture:
            case.check()
            self.met.append(case)
            return Mixture(np.array([0.5, 0.5]), np.zeros((2, len(case.model))))

        return scores

    def cost(self, _situation: Situation) -> float:
        return 11.0


def test_the_tables_of_a_draw_are_those_of_its_samples() -> None:
    certain, model = random_models(6, [2])[0], uncertain(7, 2, states=2)
    models = ModelSet.of([certain, model])
    watching = Watching()

    ready(Thompson(watching), models)

    assert len(watching.given) == 2
    for k, (drawn, tables) in enumerate(watching.given):
        expected = build_all(models.drawn(k), 0.5)
        assert_array_equal(drawn.like, models.drawn(k).like)
        assert_array_equal(tables.low, expected.low)
        assert_array_equal(tables.high, expected.high)
        for got, wanted in zip(tables.whittle, expected.whittle, strict=True):
            assert_array_equal(got, wanted)
        for got, wanted in zip(tables.value, expected.value, strict=True):
            assert_array_equal(got, wanted)


def test_all_of_a_situation_is_seen_as_in_the_draw() -> None:
    case = uncertain_situation(2)
    chosen = Slate(3, case.model[:2].copy(), case.belief[:2].copy())
    case = dataclasses.replace(case, slate=chosen)
    watching = Watching()
    scorer = Thompson(watching).prepare(case.models, build_all(ModelSet.of([]), 0.5))

    mixture = scorer(case, 0)

    assert isinstance(mixture, Mixture)
    assert mixture.weight.tolist() == [0.125] * 8
    assert len(watching.met) == 4
    for met in watching.met:
        assert_array_equal(met.count, case.count)
        assert_array_equal(met.rested, case.rested)
        assert met.slate.plays == 3
        assert_array_equal(met.slate.model, chosen.model)
        assert_array_equal(met.slate.belief, met.belief[:2])


def test_it_is_what_the_policy_followed_is() -> None:
    watching = Thompson(Watching())

    assert (watching.rest_matters, watching.is_index) == (True, False)
    assert watching.table_discount == 0.5
    assert Thompson(RoundRobin()).rest_matters
    assert Thompson(Myopic()).is_index
    assert Thompson(Myopic()).table_discount is None
    assert watching.cost(paper_situation(1)) < watching.cost(uncertain_situation(1)) / 3


def test_neither_follows_the_other() -> None:
    for outer, inner in (("thompson", "epsilon"), ("epsilon", "thompson")):
        with pytest.raises(ValueError, match=r"^policy.name: must be one of "):
            create(outer, {"policy": {"name": inner}})
    with pytest.raises(ValueError, match=r"^policy: "):
        Thompson(Epsilon())


def test_padding_changes_no_score() -> None:
    case = uncertain_situation(3)
    scores = ready(Thompson(BestFixed()), case.models)(case, 1)
    assert isinstance(scores, Mixture)
    uncertain_models = [*random_models(3, [4]), uncertain(3, 2), uncertain(4, 4, 2)]
    wide = ModelSet.of([*uncertain_models, uncertain(5, 3, 5)])
    padded = np.pad(case.belief, ((0, 0), (0, 15 - case.belief.shape[1])))
    rows = case.model.tolist()

    among = ready(Thompson(BestFixed()), wide)(
        situation(wide, rows, padded, case.count.tolist()), 1
    )

    assert isinstance(among, Mixture)
    assert_allclose(among.scores, scores.scores, atol=1e-12)
