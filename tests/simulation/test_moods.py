"""Listeners with moods, against an enumeration of all answers."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_allclose

from policies import LIKED, Model, ModelSet, Mood, MoodState, Signals, create
from simulation import Course, Listeners, Value, contenders, remainder, value
from simulation.gym import ListeningEnv, Observed
from tests.policies.instances import Instance, moody, telling_model
from tests.policies.oracles import Feeling, Plan, World, plain_rule, played, world_of

SIGMAS = 4.0
DISCOUNT = 0.8
PAUSING = Mood(answers=1, memory=2.0, levels=(0.5,), pause_s=60.0)
LAST = Mood(answers=1, memory=None, levels=(), pause_s=None)  # none, a skip, a like
FIXED = plain_rule("best_fixed", DISCOUNT)
PICKS: dict[str, Callable[[World], Sequence[int]]] = {
    "random": lambda world: world.free,
    "best_fixed": lambda world: [world.best(FIXED)],
    "myopic": lambda world: [max(world.free, key=world.reward)],
}


def instance(seed: int) -> Instance:
    """A user who has just skipped after a like, and then paused."""
    rng = np.random.default_rng(seed)
    models = (
        moody(telling_model(rng, 2, 2), PAUSING, rng),
        moody(telling_model(rng, 3, 3), PAUSING, rng),
    )
    beliefs = tuple(model.prior for model in models)
    return Instance(models, (0, 1), beliefs, (1, 1), answers=(1, 0), resumed=True)


def worth(world: World, name: str, slots: int) -> float:
    """Return what a policy earns, by all answers to all plays."""
    if slots == 0:
        return 0.0
    plan = Plan([], 0, DISCOUNT)
    worths = [
        played(plan, world, number, lambda after: worth(after, name, slots - 1))
        for number in PICKS[name](world)
    ]
    return sum(worths) / len(worths)


def simulated(
    given: Instance, course: Course, names: Sequence[str], listeners: Listeners | None
) -> Sequence[Value]:
    start = given.situation
    ready = contenders([create(name, {}) for name in names], start.models)
    return value(ready, start, course, listeners)


@pytest.mark.parametrize("clicks", [False, True])
@pytest.mark.parametrize("name", PICKS)
def test_a_policy_earns_the_sum_over_all_answers(name: str, clicks: bool) -> None:  # noqa: FBT001
    given, course = instance(2), Course(20_000, 5, DISCOUNT, seed=1)
    listeners = Listeners.believed(given.situation, clicks=clicks)

    [found] = simulated(given, course, [name], listeners)

    expected = worth(world_of(given), name, course.slots)
    assert abs(found.mean - expected) < SIGMAS * found.error
    assert found.error < 0.01


def test_listeners_may_have_moods_of_which_a_policy_knows_nothing() -> None:
    given, course = instance(3), Course(20_000, 5, DISCOUNT, seed=1)
    usual = [
        Model(
            model.states,
            model.play,
            model.rest,
            None,
            model.prior,
            Signals(model.signals, model.observe, model.reward),
        )
        for model in given.models
    ]
    start = given.situation
    listeners = Listeners(
        start.models, start.belief, mood=start.mood, resumed=start.resumed
    )
    blind = replace(given, models=tuple(usual), answers=(), resumed=False)

    [found] = simulated(blind, course, ["random"], listeners)

    expected = worth(world_of(given), "random", course.slots)
    assert abs(found.mean - expected) < SIGMAS * found.error


def test_a_mood_that_models_do_not_have_is_refused() -> None:
    start = instance(1).situation
    strange = Listeners(start.models, start.belief, mood=MoodState(recent=9))

    with pytest.raises(ValueError, match=r"^mood: "):
        strange.truth(start)


def test_planning_lifts_the_mood_first() -> None:
    """The second item is liked well by who has just liked; the last one never is."""
    still, first = np.eye(2), (1.0, 0.0)
    likes = ([0.9, 0.9, 0.9], [0.1, 0.1, 0.8])
    worths = (0.5, 1.0)
    known = [
        Model(
            ("on", "off"),
            still,
            still,
            None,
            first,
            Signals(
                ("no", "yes"), [[[1 - p, p], [1.0, 0.0]] for p in like], (0.0, most)
            ),
            mood=LAST,
        )
        for like, most in zip(likes, worths, strict=True)
    ]
    dull = Model(
        ("on", "off"),
        still,
        still,
        None,
        first,
        Signals(("dull",), [[1.0], [1.0]], [0.48]),
    )
    assert dull.reward[0] < LIKED
    models = (*known, dull)
    beliefs = (np.array(first),) * 3
    given = Instance(models, (0, 1, 2), beliefs, (1, 1, 1), answers=(0,))
    course = Course(500, 60, 0.95, seed=1)

    myopic, planned = simulated(given, course, ["myopic", "exact_rollout"], None)

    assert myopic.mean == pytest.approx(0.48 * (1 - 0.95**60) / 0.05)
    assert planned.mean > 1.3 * myopic.mean
    assert planned.mean < 0.8 / 0.05
    assert remainder(given.situation, course) == pytest.approx(0.8 * 0.95**60 / 0.05)


def env_of(given: Instance, observation: Observed) -> ListeningEnv:
    return ListeningEnv(given.situation, slots=12, observation=observation)


@pytest.mark.parametrize("observation", ["belief", "signals"])
def test_an_environment_shows_the_mood(observation: Observed) -> None:
    env = env_of(instance(4), observation)

    check_env(env, skip_render_check=True)

    assert isinstance(env.observation_space, spaces.Dict)
    assert env.observation_space["mood"] == spaces.Discrete(PAUSING.classes)


def test_an_environment_follows_the_mood() -> None:
    given, rng = instance(5), np.random.default_rng(1)
    env, world = env_of(given, "belief"), world_of(given)
    told = list(given.answers)

    seen, known = env.reset(seed=2)
    for slot in range(12):
        feeling = Feeling(tuple(told), given.resumed and slot == 0)
        assert seen["mood"] == feeling.of(PAUSING)
        rewards = [world.reward(number) for number in range(2)]
        assert_allclose(known["expected"], rewards, atol=1e-12)
        item = int(rng.integers(2))
        seen, reward, _, _, known = env.step(item)
        assert reward == pytest.approx(rewards[item])
        told.append(int(given.models[item].reward[known["signal"]] >= LIKED))
        world = world.after(item, known["signal"])
        shown = ModelSet.of(given.models).like.shape[1]
        assert seen["belief"].shape == (2, shown)
