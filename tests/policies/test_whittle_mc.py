"""The paper's index, against separate trajectories and exact sums."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from policies import Floats, Mixture, Model, ModelSet, Signals, Situation, ready
from policies.randomness import SUBSIDIES, uniform
from policies.whittle_mc import WhittleMC
from tests.policies.instances import (
    paper,
    paper_situation,
    random_model,
    random_models,
    situation,
)

SEEDS = st.integers(0, 2**63 - 1)
SHORT = st.builds(
    WhittleMC,
    horizon=st.integers(1, 5),
    trajectories=st.integers(1, 12),
    iterations=st.integers(1, 12),
    tolerance=st.sampled_from([0.0, 0.01, 0.2]),
    discount=st.sampled_from([0.0, 0.5, 0.95]),
    reward=st.sampled_from(["expected", "click"]),
)


def score(policy: WhittleMC, case: Situation, seed: int) -> Floats:
    scores = ready(policy, case.models)(case, seed)
    assert not isinstance(scores, Mixture)
    return scores


def of_three_signals(seed: int, states: int) -> Model:
    rng = np.random.default_rng(seed)
    plain = random_model(rng, states)
    observe = rng.dirichlet(np.ones(3), states)
    signals = Signals(("skip", "part", "all"), observe, rng.random(3))
    return Model(plain.states, plain.play, plain.rest, None, plain.prior, signals)


class Searching:
    """The search for one item, trajectory by trajectory, written from the formulas."""

    def __init__(self, policy: WhittleMC, model: Model, seed: int) -> None:
        self.policy, self.model, self.seed = policy, model, seed

    def subsidy(self, belief: Floats) -> float:
        subsidy = float(belief @ self.model.like)
        average = [0.0, 0.0]
        for t in range(1, self.policy.iterations + 1):
            latest = [self.mean(belief, subsidy, action) for action in (0, 1)]
            for action in (0, 1):
                average[action] += (latest[action] - average[action]) / t**0.6
            gap = average[1] - average[0]
            subsidy += gap / t**0.8
            if max(abs(gap), abs(latest[1] - latest[0])) < self.policy.tolerance:
                break
        return subsidy

    def mean(self, belief: Floats, subsidy: float, action: int) -> float:
        trajectories = range(self.policy.trajectories)
        earned = [
            self.earned(belief, subsidy, action, number) for number in trajectories
        ]
        return sum(earned) / len(earned)

    def earned(self, belief: Floats, subsidy: float, action: int, number: int) -> float:
        total = 0.0
        for h in range(self.policy.horizon):
            expected = float(belief @ self.model.like)
            played = bool(action) if h == 0 else expected > subsidy
            reward = subsidy
            if played:
                signal = self.signal(belief, uniform(self.seed, SUBSIDIES, number, h))
                drawn = float(self.model.reward[signal])
                reward = expected if self.policy.reward == "expected" else drawn
                told = belief * self.model.observe[:, signal]
                belief = told / told.sum() @ self.model.play
            else:
                belief = belief @ self.model.rest
            total += self.policy.discount**h * reward
        return total

    def signal(self, belief: Floats, draw: float) -> int:
        chances = belief @ self.model.observe
        last = len(chances) - 1
        for signal in range(last, 0, -1):
            if draw < chances[signal:].sum():
                return signal
        return 0


@settings(deadline=None, max_examples=80)
@given(SHORT, st.integers(0, 2**32), st.integers(2, 4), st.integers(2, 3), SEEDS)
def test_scores_are_those_of_separate_trajectories(
    policy: WhittleMC, instance: int, states: int, signals: int, seed: int
) -> None:
    rng = np.random.default_rng(instance)
    model = random_model(rng, states)
    if signals > 2:
        model = of_three_signals(instance, states)
    belief = rng.dirichlet(np.ones(states), 3)
    case = situation(ModelSet.of([model]), [0, 0, 0], belief, [1, 2, 1])

    expected = [Searching(policy, model, seed).subsidy(row) for row in belief]

    assert_allclose(score(policy, case, seed), expected, rtol=0, atol=1e-12)


def advantage(model: Model, belief: Floats, subsidy: float, horizon: int) -> float:
    """Return exactly what playing first earns more than resting first."""
    return earned_by_play(model, belief, subsidy, horizon) - earned_by_rest(
        model, belief, subsidy, horizon
    )


def earned_by_rest(model: Model, belief: Floats, subsidy: float, slots: int) -> float:
    return subsidy + 0.95 * earned(model, belief @ model.rest, subsidy, slots - 1)


def earned_by_play(model: Model, belief: Floats, subsidy: float, slots: int) -> float:
    total = float(belief @ model.like)
    for signal in range(len(model.signals)):
        told = belief * model.observe[:, signal]
        after = told / told.sum() @ model.play
        total += 0.95 * told.sum() * earned(model, after, subsidy, slots - 1)
    return total


def earned(model: Model, belief: Floats, subsidy: float, slots: int) -> float:
    if slots == 0:
        return 0.0
    act = earned_by_play if belief @ model.like > subsidy else earned_by_rest
    return act(model, belief, subsidy, slots)


@pytest.mark.parametrize("horizon", [1, 2, 3, 5])
@pytest.mark.parametrize("reward", ["expected", "click"])
def test_with_many_trajectories_both_actions_earn_the_same(
    horizon: int, reward: str
) -> None:
    """The exact advantage of a play changes sign within a hundredth of the score."""
    near = 0.01 if reward == "expected" else 0.03
    models = [
        *paper(1),
        *paper(3),
        *random_models(5, [2, 3, 4]),
        of_three_signals(1, 3),
    ]
    policy = WhittleMC(
        horizon=horizon,
        trajectories=10_000,
        iterations=20,
        reward=reward,  # type: ignore[arg-type]
    )
    for model in models:
        case = situation(ModelSet.of([model]), [0], model.prior[None], [1])

        subsidy = float(score(policy, case, 1)[0])

        assert advantage(model, model.prior, subsidy - near, horizon) > 0
        assert advantage(model, model.prior, subsidy + near, horizon) < 0


def test_over_one_slot_it_is_the_expected_reward() -> None:
    case = paper_situation(1)

    scores = score(WhittleMC(horizon=1), case, 1)

    assert_allclose(scores, [0.59, 0.435, 0.54, 0.435, 0.55], atol=1e-15)


def test_over_two_slots_it_is_the_index_of_two_slots() -> None:
    """In the last slot, playing where that earns more at once is the best there is."""
    policy = WhittleMC(horizon=2, trajectories=5_000, tolerance=1e-4)

    scores = score(policy, paper_situation(3), 1)

    assert_allclose(scores, [0.5839, 0.4817, 0.6049, 0.4506, 0.6117], atol=0.002)


def test_over_more_slots_myopic_plays_lower_it() -> None:
    """With the best plays it is .6132, .5126, .6204, .4690, .6346."""
    policy = WhittleMC(horizon=4, trajectories=2_500)

    scores = score(policy, paper_situation(3), 1)

    assert_allclose(scores, [0.611, 0.508, 0.619, 0.469, 0.634], atol=0.002)


def test_it_puts_the_items_of_example_three_in_another_order_than_whittle() -> None:
    """Whittle's index is .6547, .5891, .6478, .5152, .6542."""
    for seed in range(5):
        scores = score(WhittleMC(), paper_situation(3), seed)
        assert np.argsort(-scores).tolist() == [4, 2, 0, 1, 3]


def test_neither_row_nor_company_nor_padding_changes_a_bit() -> None:
    small, large = random_models(2, [3, 6])
    one, both = ModelSet.of([small]), ModelSet.of([large, small])
    belief = np.random.default_rng(2).dirichlet(np.ones(3), 1)
    wide = np.pad(belief, ((0, 0), (0, 3)))
    alone = situation(one, [0], belief, [1])
    among = situation(both, [0, 1, 1], np.concatenate((both.prior, wide)), [3, 4, 5])

    for policy in (WhittleMC(), WhittleMC(reward="click")):
        (score_alone,) = score(policy, alone, 5)
        assert score(policy, among, 5)[2] == score_alone


def test_seeds_differ() -> None:
    case = paper_situation(1)

    assert not np.array_equal(score(WhittleMC(), case, 1), score(WhittleMC(), case, 2))


def test_parameters_that_are_too_much_together_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^iterations: times horizon times"):
        WhittleMC(horizon=50, trajectories=10_000)
