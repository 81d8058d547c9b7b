"""Simulated values, against closed forms and an enumeration of all signals."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from policies import (
    Floats,
    Mixture,
    Model,
    ModelSet,
    Policy,
    Signals,
    Situation,
    create,
)
from simulation import (
    Contender,
    Course,
    Listeners,
    Value,
    contenders,
    remainder,
    slots_of,
    standard_error,
    value,
)
from simulation.contender import AT_ONCE
from simulation.playing import played
from simulation.value import quantile
from tests.policies.instances import paper_situation, situation, telling_model

SIGMAS = 4.0
STATES = ("low", "high")
TIRING = Model(
    STATES,
    [[0.9, 0.1], [0.5, 0.5]],
    [[0.4, 0.6], [0.1, 0.9]],
    None,
    [0.5, 0.5],
    Signals(("skip", "part", "all"), [[0.6, 0.3, 0.1], [0.1, 0.2, 0.7]], [0, 0.4, 1]),
)
LASTING = Model(
    STATES, [[0.7, 0.3], [0.2, 0.8]], [[0.7, 0.3], [0.2, 0.8]], [0.1, 0.9], [0.3, 0.7]
)


def simulated(
    start: Situation, course: Course, *policies: Policy, threads: int = 2
) -> Sequence[Value]:
    return value(contenders(policies, start.models), start, course, threads=threads)


def paper_course(runs: int) -> Course:
    return Course(runs, slots_of(0.95), 0.95, seed=3)


@pytest.mark.parametrize(
    ("example", "name", "worth"),
    [
        (1, "best_fixed", 14.1238),
        (2, "best_fixed", 8.9508),
        (3, "best_fixed", 12.963117368826),
        (1, "random", 11.91184472),
        (2, "random", 5.46993013),
        (3, "random", 8.98768965),
    ],
)
def test_values_of_the_paper_are_those_of_closed_forms(
    example: int, name: str, worth: float
) -> None:
    start, course = paper_situation(example), paper_course(4000)

    [found] = simulated(start, course, create(name, {}))

    slack = SIGMAS * found.error + 1e-4
    assert -slack < worth - found.mean < remainder(start, course) + slack
    assert found.shares.sum() == pytest.approx(1)


@pytest.mark.parametrize("name", ["whittle", "exact_rollout"])
def test_the_optimum_of_example_2_is_earned_by_whom_the_theory_says(name: str) -> None:
    start, course = paper_situation(2), paper_course(400)

    [found] = simulated(start, course, create(name, {"discount": 0.95}))

    optimum = 8.986321013638
    short = 0.0 if name == "whittle" else 0.05
    assert found.mean < optimum + SIGMAS * found.error
    assert found.mean > optimum - short - remainder(start, course) - 4 * found.error


def test_the_mean_is_that_over_all_signals() -> None:
    """Two items of one model, which are a group until one is played, and another."""
    models = [TIRING, LASTING]
    start = situation(ModelSet.of(models), [0, 1], ModelSet.of(models).prior, [2, 1])
    course = Course(runs=40_000, slots=5, discount=0.8, seed=1)

    [found] = simulated(start, course, create("myopic", {}))

    items = [(0, 0, models[0].prior), (0, 0, models[0].prior), (1, 1, models[1].prior)]
    worth, shares = enumerated(models, items, course.slots, course.discount)
    assert abs(found.mean - worth) < SIGMAS * found.error
    assert (shares > 1).all()
    assert np.abs(found.shares - shares / course.slots).max() < 0.01
    assert 0 < found.error < 0.01


Item = tuple[int, int, Floats]  # model, group of the start, belief


def enumerated(
    models: Sequence[Model], items: Sequence[Item], slots: int, discount: float
) -> tuple[float, Floats]:
    """The worth of myopic play, and the plays of each group, over all signals."""
    if slots == 0:
        return 0.0, np.zeros(2)
    chances = [float(belief @ models[m].like) for m, _, belief in items]
    played_ = int(np.argmax(np.round(chances, 12)))
    m, group, belief = items[played_]
    worth, plays = chances[played_], np.eye(2)[group]
    for told in models[m].observe.T:
        chance = float(belief @ told)
        after = [(k, g, b @ models[k].rest) for k, g, b in items]
        after[played_] = (m, group, (belief * told / chance) @ models[m].play)
        later, more = enumerated(models, after, slots - 1, discount)
        worth, plays = worth + discount * chance * later, plays + chance * more
    return worth, plays


@pytest.mark.parametrize("name", ["random", "round_robin", "myopic", "whittle"])
def test_runs_in_step_earn_what_each_earns_alone(name: str) -> None:
    rng = np.random.default_rng(2)
    models = ModelSet.of([telling_model(rng, 3, 3), telling_model(rng, 2, 2)])
    start = situation(
        models, [0, 1, 0], np.vstack((models.prior, models.prior[:1])), [3, 2, 1]
    )
    course = Course(runs=7, slots=12, discount=0.9, seed=8)
    [contender] = contenders([create(name, {})], models)

    listeners = Listeners.believed(start)
    together = played(contender, start, listeners, course, 0, 7)
    alone = [played(contender, start, listeners, course, run, 1) for run in range(7)]

    assert contender.at_once
    assert_array_equal(together.reward, np.concatenate([one.reward for one in alone]))
    assert_array_equal(together.plays, sum(one.plays for one in alone))
    assert len(set(together.reward.tolist())) > 1


def test_items_of_a_group_earn_what_they_earn_one_by_one() -> None:
    rng = np.random.default_rng(4)
    models = ModelSet.of([telling_model(rng, 3, 2), telling_model(rng, 3, 2)])
    grouped = situation(models, [0, 1], models.prior, [3, 2])
    apart = situation(
        models, [0] * 3 + [1] * 2, models.prior[[0] * 3 + [1] * 2], [1] * 5
    )
    course = Course(runs=20, slots=15, discount=0.9, seed=5)

    for policy in (create("myopic", {}), create("exact_rollout", {"horizon": 2})):
        [one], [other] = (
            simulated(start, course, policy) for start in (grouped, apart)
        )
        assert_array_equal(one.rewards, other.rewards)
        assert one.shares.tolist() == pytest.approx(
            [other.shares[:3].sum(), other.shares[3:].sum()]
        )


def test_numbers_do_not_depend_on_threads_or_company() -> None:
    start, course = paper_situation(1), Course(60, 20, 0.95, seed=11)
    rollout = create("rollout", {"horizon": 2, "trajectories": 5})
    epsilon = create("epsilon", {"epsilon": 0.3})

    first, second, third = simulated(start, course, rollout, epsilon, rollout)
    [alone] = simulated(start, course, epsilon, threads=1)

    assert_array_equal(second.rewards, alone.rewards)
    assert_array_equal(second.shares, alone.shares)
    assert_array_equal(first.rewards, third.rewards)
    assert_array_equal(second.difference, second.rewards - first.rewards)
    assert not first.difference.any()
    assert not third.difference.any()


def test_another_seed_gives_other_numbers() -> None:
    start, policy = paper_situation(1), create("myopic", {})

    one, other = (
        simulated(start, Course(50, 20, 0.95, seed), policy)[0] for seed in (1, 2)
    )

    assert (one.rewards != other.rewards).all()


def test_pairing_narrows_a_difference() -> None:
    start, course = paper_situation(1), paper_course(300)

    whittle, myopic = simulated(
        start, course, create("whittle", {}), create("myopic", {})
    )

    apart = np.hypot(whittle.error, myopic.error)
    assert standard_error(myopic.difference) < 0.9 * apart


def test_only_policies_that_judge_items_for_themselves_decide_at_once() -> None:
    at_once = {
        name
        for name in ("random", "rollout", "exact_rollout", "lagrangian", "whittle_mc")
        if isinstance(create(name, {}), AT_ONCE)
    }

    assert at_once == {"random"}


def test_progress_is_told_to_the_end() -> None:
    start, told = paper_situation(1), list[float]()
    ready = contenders([create("myopic", {}), create("lagrangian", {})], start.models)

    value(ready, start, Course(5, 3, 0.9, 1), progress=told.append)

    assert told == sorted(told)
    assert told[-1] == pytest.approx(1)


@pytest.mark.parametrize("scored", [np.array([np.nan] * 5), None])
def test_scores_that_are_no_numbers_are_refused(scored: Floats | None) -> None:
    start = paper_situation(1)
    bad = np.array([[1.0] * 5, [np.inf] * 5])
    answer = Mixture(np.array([0.5, 0.5]), bad) if scored is None else scored

    def scorer(_situation: Situation, _seed: int) -> Floats | Mixture:
        return answer

    with pytest.raises(ValueError, match="not finite"):
        value([Contender(scorer, at_once=False)], start, Course(2, 3, 0.9, 1))


def test_nothing_to_play_is_refused() -> None:
    models = paper_situation(1).models
    none = situation(models, [], np.empty((0, 4)), [])

    with pytest.raises(ValueError, match="must hold items"):
        simulated(none, Course(2, 2, 0.9, 1), create("myopic", {}))


@pytest.mark.parametrize(
    ("field", "course"),
    [
        ("runs", (1, 10, 0.9, 0)),
        ("slots", (10, 0, 0.9, 0)),
        ("discount", (10, 10, 1.0, 0)),
        ("discount", (10, 10, float("nan"), 0)),
        ("seed", (10, 10, 0.9, 2**63)),
    ],
)
def test_a_course_that_is_none_names_its_fault(
    field: str, course: tuple[int, int, float, int]
) -> None:
    with pytest.raises(ValueError, match=f"^{field}: "):
        Course(*course)


@pytest.mark.parametrize("discount", [0.0, 0.01, 0.1, 0.5, 0.95, 0.99, 0.999])
def test_the_usual_length_is_the_least_that_leaves_a_ten_thousandth(
    discount: float,
) -> None:
    slots = slots_of(discount)

    assert discount**slots < 1e-4
    assert slots == 1 or discount ** (slots - 1) >= 1e-4


@pytest.mark.parametrize(
    ("freedom", "known"),
    [(1, 12.706), (4, 2.776), (5, 2.571), (10, 2.228), (30, 2.042), (10**6, 1.960)],
)
def test_intervals_are_those_of_student(freedom: int, known: float) -> None:
    assert quantile(freedom) == pytest.approx(known, abs=0.004)
