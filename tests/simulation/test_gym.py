"""The Gymnasium environment: checked, true to the simulation, and learnt from."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence
from numpy.testing import assert_allclose, assert_array_equal

from policies import Floats, Model, ModelSet, choose, create
from simulation import Course, Listeners, contenders, example, opening, value
from simulation.examples import DISCOUNT, NUMBERS
from simulation.gym import ListeningEnv, of_example
from tests.filter import Filter
from tests.policies.instances import telling_model

SIGMAS = 4.0
STARTS = ("belief", "state")
SCORES = ("expected", "clicks")
OBSERVATIONS = ("belief", "signals")
ITEMS = (0, 2, 2, 1, 0, 1, 2, 0)
DOCUMENT = Path(__file__).parents[2] / "docs" / "gym.md"


def made(number: int, slots: int = 180, **options: str) -> ListeningEnv:
    name = f"simulation.gym:Encore/Example{number}-v0"
    env = gymnasium.make(name, slots=slots, **options)  # type: ignore[arg-type]
    assert isinstance(env.unwrapped, ListeningEnv)
    return env.unwrapped


@pytest.mark.parametrize(
    ("number", "start", "score", "observation"),
    [*product(NUMBERS, STARTS, SCORES, OBSERVATIONS)],
)
def test_gymnasium_finds_nothing_wrong(
    number: int, start: str, score: str, observation: str
) -> None:
    check_env(made(number, start=start, score=score, observation=observation))


@pytest.mark.parametrize(("start", "score"), [*product(STARTS, SCORES)])
def test_a_policy_earns_what_it_earns_in_a_simulation(start: str, score: str) -> None:
    episodes, course = 400, Course(20_000, 40, DISCOUNT, seed=1)
    env, paper = made(2, start=start, score=score, slots=course.slots), example(2)
    env.reset(seed=4)
    [ready] = contenders([create("myopic", {})], env.situation.models)
    first = paper.start
    listeners = paper.in_states(first) if start == "state" else None

    [simulated] = value([ready], first, course, listeners)

    def play() -> int:
        return choose(ready.scorer(env.situation, 0), env.situation.count, 0).group

    earned = np.array([discounted(env, play) for _ in range(episodes)])
    error = np.hypot(earned.std(ddof=1) / np.sqrt(episodes), simulated.error)
    assert abs(earned.mean() - simulated.mean) < SIGMAS * error
    assert error < 0.1


def discounted(env: ListeningEnv, play: Callable[[], int]) -> float:
    """What an episode earns."""
    env.reset()
    total, worth, over = 0.0, 1.0, False
    while not over:
        _, reward, terminated, over, _ = env.step(play())
        assert not terminated
        total += worth * reward
        worth *= DISCOUNT
    return total


def described(name: str, model: Model) -> dict[str, Any]:
    """A model as the independent filter takes it."""
    return {
        "id": name,
        "prior": model.prior.tolist(),
        "play": model.play.tolist(),
        "rest": model.rest.tolist(),
        "signals": list(model.signals),
        "observe": model.observe.tolist(),
        "reward": model.reward.tolist(),
    }


def telling_models(seed: int) -> Sequence[Model]:
    """One of three states and signals, and one of two."""
    rng = np.random.default_rng(seed)
    return [telling_model(rng, 3, 3), telling_model(rng, 2, 2)]


@pytest.mark.parametrize("clicks", [False, True])
def test_what_is_believed_and_expected_is_what_an_independent_filter_says(
    *, clicks: bool
) -> None:
    """Of two items of one model and one of another, and listeners who are otherwise."""
    believed, true = telling_models(1), telling_models(2)
    models = ModelSet.of(true)
    listeners = Listeners(models, models.prior, clicks)
    env = ListeningEnv(opening(believed, [2, 1]), listeners, slots=len(ITEMS))
    names, kinds = ("a", "b", "c"), (0, 0, 1)
    beliefs, law = (
        Filter([described(n, kind[k]) for n, k in zip(names, kinds, strict=True)])
        for kind in (believed, true)
    )

    seen, told = env.reset(seed=3)
    for item in ITEMS:
        assert_allclose(seen, stacked(beliefs), atol=1e-12)
        assert_array_equal(told["belief"], seen)
        expected = [law.like(name) for name in names]
        assert_allclose(told["expected"], expected, atol=1e-12)
        for returned in (seen, *told.values()):
            np.asarray(returned).fill(0)  # it is the caller's own
        seen, reward, _, _, told = env.step(item)
        model = true[kinds[item]]
        worth = model.reward[told["signal"]] if clicks else expected[item]
        assert reward == pytest.approx(worth)
        for filter_ in (beliefs, law):
            filter_.take(names[item], model.signals[told["signal"]])


def stacked(beliefs: Filter) -> Floats:
    rows = list(beliefs.beliefs.values())
    return np.array([row + [0.0] * (3 - len(row)) for row in rows])


def test_hidden_states_are_as_often_so_as_the_filter_expects() -> None:
    believed, true = telling_models(1), telling_models(2)
    listeners = Listeners(ModelSet.of(true), ModelSet.of(believed).prior)
    env = ListeningEnv(opening(believed, [2, 1]), listeners, slots=len(ITEMS))
    likes = [true[kind].like for kind in (0, 0, 1)]

    def surprises(told: dict[str, Any]) -> Floats:
        now = [like[state] for like, state in zip(likes, told["state"], strict=True)]
        expected: Floats = told["expected"]
        return np.array(now) - expected

    env.reset(seed=9)
    found = np.array(
        [
            [surprises(env.reset()[1]), *(surprises(env.step(i)[4]) for i in ITEMS)]
            for _ in range(2000)
        ]
    )
    error = found.std(axis=0, ddof=1) / np.sqrt(len(found))
    assert (np.abs(found.mean(axis=0)) < SIGMAS * error).all()
    assert error.max() < 0.01


def test_what_rounding_adds_is_not_observed() -> None:
    to_the_first = [[1, 0, 0, 0, 0]] * 5
    prior = [0.1, 0.1, 0.5, 0.2, 0.1]
    model = Model(list("abcde"), to_the_first, to_the_first, [0.5] * 5, prior)
    env = ListeningEnv(opening([model], [2]), slots=9)
    env.reset(seed=1)

    seen, _, _, _, told = env.step(0)

    assert told["belief"].max() > 1
    assert seen in env.observation_space


def test_signals_are_what_a_client_sees_whatever_is_believed() -> None:
    true = opening(telling_models(2), [2, 1])
    envs = [
        ListeningEnv(
            opening(telling_models(seed), [2, 1]),
            Listeners.believed(true),
            slots=len(ITEMS),
            observation="signals",
        )
        for seed in (1, 5)
    ]
    last, since = [0, 0, 0], [0, 0, 0]

    seen = [env.reset(seed=3)[0] for env in envs]
    for item in ITEMS:
        for observation in seen:
            assert observation.keys() == {"signal", "rested"}
            assert observation["signal"].tolist() == last
            assert observation["rested"].tolist() == since
        steps = [env.step(item) for env in envs]
        seen = [step[0] for step in steps]
        signals = {step[4]["signal"] for step in steps}
        since = [slots + 1 for slots in since]
        last[item], since[item] = 1 + signals.pop(), 0
        assert not signals


@pytest.mark.parametrize("observation", OBSERVATIONS)
def test_the_same_seed_gives_the_same_episode(observation: str) -> None:
    env = made(1, observation=observation, slots=30)

    one, again, other = (episode(env, seed) for seed in (7, 7, 8))

    assert data_equivalence(one, again, exact=True)
    assert not data_equivalence(one, other)
    assert [step[3] for step in one[1:]] == [False] * 29 + [True]


def episode(env: ListeningEnv, seed: int) -> list[tuple[Any, ...]]:
    return [env.reset(seed=seed), *(env.step(slot % 5) for slot in range(30))]


def test_several_listeners_are_met_at_a_time() -> None:
    several = gymnasium.make_vec(
        "simulation.gym:Encore/Example3-v0", 2, "sync", score="clicks"
    )
    alone = [of_example(3, score="clicks") for _ in range(2)]

    seen, _ = several.reset(seed=5)
    assert_array_equal(seen, [env.reset(seed=5 + k)[0] for k, env in enumerate(alone)])
    for items in np.random.default_rng(0).integers(5, size=(20, 2)):
        seen, rewards, *_ = several.step(items)
        steps = [env.step(item) for env, item in zip(alone, items, strict=True)]
        assert_array_equal(seen, [step[0] for step in steps])
        assert_array_equal(rewards, [step[1] for step in steps])


@pytest.mark.parametrize("action", [-1, 5, 0.5, "1", None])
def test_an_action_that_is_no_item_is_refused(action: Any) -> None:  # noqa: ANN401
    env = of_example(1)
    env.reset(seed=1)

    with pytest.raises(InvalidAction, match=r"^action: "):
        env.step(action)


def test_an_episode_is_begun_first_and_not_outlived() -> None:
    env = of_example(1, slots=1)

    with pytest.raises(ResetNeeded):
        env.step(0)
    env.reset(seed=1)
    assert env.step(0)[3]
    with pytest.raises(ResetNeeded):
        env.step(0)


@pytest.mark.parametrize(
    ("field", "options"),
    [
        ("slots", {"slots": 0}),
        ("observation", {"observation": "state"}),
        ("start", {"start": "prior"}),
        ("score", {"score": "likes"}),
    ],
)
def test_an_option_that_is_none_is_named(field: str, options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=f"^{field}: must be"):
        of_example(1, **options)


def test_the_documented_learner_earns_what_is_documented() -> None:
    text = DOCUMENT.read_text()
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    promised = "".join(re.findall(r"```text\n(.*?)```", text, re.DOTALL))

    told = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=DOCUMENT.parents[1],
        # Matrices this small are slower on several threads, where cores are shared.
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        check=True,
        capture_output=True,
        text=True,
    ).stdout

    assert NUMBER.sub("#", told) == NUMBER.sub("#", promised)
    assert_allclose(numbers(told), numbers(promised), atol=0.02)
    worth = {line.split()[0]: numbers(line)[0] for line in told.splitlines()}
    assert worth["random"] < worth["myopic"] < worth["learned"] < 8.9864 + 0.01


NUMBER = re.compile(r"\d+(?:\.\d+)?")


def numbers(text: str) -> list[float]:
    return [float(number) for number in NUMBER.findall(text)]
