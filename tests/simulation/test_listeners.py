"""Listeners who are not as policies believe, against closed forms and enumeration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from policies import Floats, Model, ModelSet, create
from simulation import (
    Course,
    Listeners,
    Value,
    contenders,
    drawn,
    example,
    opening,
    remainder,
    slots_of,
    standard_error,
    value,
)
from simulation.examples import DISCOUNT, IN_STATES, Example
from tests.policies.instances import telling_model

SIGMAS = 4.0
NONE: Mapping[str, object] = MappingProxyType({})
FIRST = Course(runs=4000, slots=slots_of(DISCOUNT), discount=DISCOUNT, seed=5)


def tried(
    paper: Example,
    course: Course,
    *names: str,
    clicks: bool = False,
    params: Mapping[str, object] = NONE,
) -> Sequence[Value]:
    """What policies earn of listeners who begin in the paper's states."""
    start = paper.start
    policies = [create(name, params) for name in names]
    listeners = paper.in_states(start, clicks=clicks)
    return value(contenders(policies, start.models), start, course, listeners)


def certain(model: Model, state: int) -> Floats:
    law: Floats = np.eye(len(model.states))[state]
    return law


def random_play(paper: Example, course: Course) -> float:
    """What uniform play earns: each item is played one time in N, whatever happens."""
    share = 1 / len(paper.models)
    total = 0.0
    for model, state in zip(paper.models, IN_STATES, strict=True):
        law = certain(model, state)
        for slot in range(course.slots):
            total += course.discount**slot * share * float(law @ model.like)
            law = share * law @ model.play + (1 - share) * law @ model.rest
    return total


def best_fixed(paper: Example, course: Course) -> float:
    """What the item earns that seems best by the beliefs, played for ever."""

    def worth(model: Model, law: Floats) -> float:
        total = 0.0
        for slot in range(course.slots):
            total += course.discount**slot * float(law @ model.like)
            law = law @ model.play
        return total

    seeming = [worth(model, model.prior) for model in paper.models]
    best = int(np.argmax(seeming))
    model = paper.models[best]
    return worth(model, certain(model, IN_STATES[best]))


@pytest.mark.parametrize("clicks", [False, True])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_play_from_the_papers_states_is_worth_what_closed_forms_say(
    number: int, *, clicks: bool
) -> None:
    paper = example(number)

    uniform, fixed = tried(paper, FIRST, "random", "best_fixed", clicks=clicks)

    assert abs(uniform.mean - random_play(paper, FIRST)) < SIGMAS * uniform.error
    assert abs(fixed.mean - best_fixed(paper, FIRST)) < SIGMAS * fixed.error + 1e-9


@pytest.mark.parametrize(
    ("number", "name", "worth"),
    [
        (1, "myopic", 13.07),
        (2, "myopic", 8.33),
        (3, "myopic", 10.747),
        (2, "whittle", 9.07),
        (3, "whittle", 12.248),
    ],
)
def test_from_the_papers_states_policies_earn_what_is_known(
    number: int, name: str, worth: float
) -> None:
    paper = example(number)

    [found] = tried(paper, FIRST, name)

    rounding = 0.005 + remainder(paper.start, FIRST)
    assert abs(found.mean - worth) < rounding + SIGMAS * found.error


@pytest.mark.parametrize(("number", "worth"), [(1, 13.28), (2, 9.00), (3, 12.92)])
def test_from_the_papers_states_planning_earns_what_is_known(
    number: int, worth: float
) -> None:
    paper, course = example(number), replace(FIRST, runs=300)
    planning = {"base": "myopic", "horizon": 5, "leaf": "none"}

    [found] = tried(paper, course, "exact_rollout", params=planning)

    rounding = 0.005 + remainder(paper.start, course)
    assert abs(found.mean - worth) < rounding + SIGMAS * found.error


def test_what_is_expected_is_what_is_answered_with_less_noise() -> None:
    start = example(1).start
    ready = contenders([create("myopic", {})], start.models)

    [expected], [answered] = (
        value(ready, start, FIRST, Listeners.believed(start, clicks=clicks))
        for clicks in (False, True)
    )

    assert abs(expected.mean - answered.mean) < SIGMAS * np.hypot(
        expected.error, answered.error
    )
    assert answered.error > 3 * expected.error
    assert len(np.unique(answered.rewards)) > len(answered.rewards) / 2


@dataclass(frozen=True)
class Seen:
    """An item: its models as believed and as they are, and where it may be by each."""

    believed: Model
    true: Model
    belief: Floats
    law: Floats

    def played(self, signal: int) -> "Seen":
        return replace(
            self,
            belief=after(self.believed, self.belief, signal),
            law=after(self.true, self.law, signal),
        )

    def rested(self) -> "Seen":
        return replace(
            self, belief=self.belief @ self.believed.rest, law=self.law @ self.true.rest
        )


def after(model: Model, law: Floats, signal: int) -> Floats:
    told = law * model.observe[:, signal]
    moved: Floats = told / told.sum() @ model.play
    return moved


def enumerated(items: Sequence[Seen], slots: int, discount: float) -> float:
    """What myopic play by beliefs earns of those who are otherwise."""
    if slots == 0:
        return 0.0
    chances = [float(item.belief @ item.believed.like) for item in items]
    best = int(np.argmax(np.round(chances, 12)))
    item = items[best]
    worth = float(item.law @ item.true.like)
    for signal, chance in enumerate(item.law @ item.true.observe):
        rest = [each.rested() for each in items]
        rest[best] = item.played(signal)
        worth += discount * chance * enumerated(rest, slots - 1, discount)
    return worth


@pytest.mark.parametrize("clicks", [False, True])
def test_wrong_beliefs_earn_what_all_signals_say(*, clicks: bool) -> None:
    """Also of true models that have more states than are believed in."""
    rng = np.random.default_rng(6)
    believed = [telling_model(rng, 2, 3), telling_model(rng, 2, 3)]
    true = [telling_model(rng, 3, 3), telling_model(rng, 2, 3)]
    start, course = opening(believed), Course(40_000, 4, 0.8, seed=7)
    models = ModelSet.of(true)
    listeners = Listeners(models, models.prior, clicks)
    ready = contenders([create("myopic", {})], start.models)

    [found] = value(ready, start, course, listeners)

    items = [
        Seen(one, other, one.prior, other.prior)
        for one, other in zip(believed, true, strict=True)
    ]
    worth = enumerated(items, course.slots, course.discount)
    assert abs(found.mean - worth) < SIGMAS * found.error
    assert found.error < 0.01


def test_listeners_who_are_as_believed_earn_the_same_to_the_bit() -> None:
    start, course = example(2).start, replace(FIRST, runs=30)
    ready = contenders([create("whittle", {})], start.models)

    [believed] = value(ready, start, course)
    [copied] = value(ready, start, course, Listeners(start.models, start.belief.copy()))

    assert_array_equal(believed.rewards, copied.rewards)
    assert_array_equal(believed.shares, copied.shares)


def test_a_course_goes_on_where_another_has_ended() -> None:
    paper = example(1)
    course = replace(FIRST, runs=30)

    [whole] = tried(paper, course, "myopic")
    [one] = tried(paper, replace(course, runs=12), "myopic")
    [other] = tried(paper, replace(course, runs=18, first=12), "myopic")

    assert_array_equal(whole.rewards, np.append(one.rewards, other.rewards))


def test_a_curve_is_what_shorter_runs_earn() -> None:
    paper = example(2)
    course = replace(FIRST, runs=50, slots=20)

    [long] = tried(paper, course, "myopic")
    [short] = tried(paper, replace(course, slots=7), "myopic")

    assert long.curve[-1] == pytest.approx(long.mean)
    assert long.curve_error[-1] == pytest.approx(standard_error(long.rewards))
    assert_allclose(long.curve[:7], short.curve, rtol=1e-14)
    assert (np.diff(long.curve) > 0).all()


def test_drawn_instances_differ_by_seed_alone() -> None:
    one, again, other = drawn(1), drawn(1), drawn(2)

    assert len(one) == 15
    assert all((np.diff(model.like) >= 0).all() for model in one)
    for model, same, different in zip(one, again, other, strict=True):
        assert_array_equal(model.play, same.play)
        assert not np.allclose(model.play, different.play)


@pytest.mark.parametrize("states", [(0, 0), (0, 0, 0, 0, 4), (0, 0, 0, 0, -1)])
def test_states_that_are_none_are_refused(states: Sequence[int]) -> None:
    start = example(1).start

    with pytest.raises(ValueError, match=r"^states: must be one of each group's"):
        Listeners.in_states(start, states)


def test_listeners_who_answer_otherwise_are_refused() -> None:
    rng = np.random.default_rng(0)
    start = opening([telling_model(rng, 2, 3)])
    others = opening([telling_model(rng, 2, 2)])
    ready = contenders([create("myopic", {})], start.models)

    with pytest.raises(ValueError, match=r"^models: the true ones"):
        value(ready, start, FIRST, Listeners(others.models, others.belief))
    two = opening([telling_model(rng, 2, 3), telling_model(rng, 2, 3)])
    with pytest.raises(ValueError, match=r"^models: must be as many"):
        value(ready, start, FIRST, Listeners(two.models, two.belief))
    for bad in (np.eye(2), np.full((1, 3), 1 / 3), np.empty((1, 0))):
        with pytest.raises(ValueError, match=r"^belief: must have the shape \(1, 2\)"):
            value(ready, start, FIRST, Listeners(start.models, bad))
    for none in ([[1.0, 1.0]], [[np.nan, 1.0]], [[2.0, -1.0]]):
        with pytest.raises(ValueError, match=r"^belief: a row is no distribution"):
            value(ready, start, FIRST, Listeners(start.models, np.array(none)))


def test_there_are_three_examples() -> None:
    with pytest.raises(ValueError, match=r"^example: must be one of"):
        example(4)
