"""Moods: what they follow from, and what models, beliefs and policies make of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from policies import (
    NEUTRAL,
    NO_TABLES,
    NONE,
    POLICIES,
    Floats,
    InvalidModel,
    Mixture,
    Model,
    ModelSet,
    Mood,
    Policy,
    Signals,
    Situation,
    answered,
    bound,
    create,
    expected_like,
    forecast,
    ready,
    replayed,
    rested,
    untouched,
)
from tests.policies.instances import (
    MOODS,
    Instance,
    even_tempered,
    moods,
    moody,
    paper,
    random_model,
    slates,
    telling_model,
    uncertain,
)
from tests.policies.oracles import Feeling, Slot, emission, enumerated_belief
from tests.policies.rules import Rules

ANSWERS = st.lists(st.sampled_from([0, 1, NONE]), max_size=12)
LAST = Mood(answers=1, memory=None, levels=(), pause_s=None)  # none, a skip, a like
EVERY = [[0.1, 0.2]] * 3
NAMES = ("x", "y")


def in_last(like: object, **given: object) -> Model:
    even = np.full((2, 2), 0.5)
    return Model(("a", "b"), even, even, like, even[0], **given)  # type: ignore[arg-type]


def score(policy: Policy, case: Situation) -> Floats:
    scores = ready(policy, case.models, 60)(case, 1)
    return scores.scores if isinstance(scores, Mixture) else scores


@settings(deadline=None)
@given(MOODS, ANSWERS, st.sampled_from([None, 10.0, 1800.0, 1801.0]))
def test_a_mood_is_the_last_answers_their_tendency_and_a_pause(
    mood: Mood, answers: list[int], waited: float | None
) -> None:
    told = tuple(answer for answer in answers if answer != NONE)
    paused = mood.pause_s is not None and waited == 1801.0

    state = NEUTRAL
    for answer in answers:
        state = mood.after(state, answer)

    assert mood.of(state, waited) == Feeling(told, paused).of(mood)
    assert state.told == len(told)


@settings(deadline=None)
@given(MOODS, st.lists(ANSWERS, max_size=4), st.integers(0, 2**32))
def test_in_a_log_every_user_has_a_mood_for_himself(
    mood: Mood, users: list[list[int]], seed: int
) -> None:
    liked = [answer for user in users for answer in user]
    rng = np.random.default_rng(seed)
    seconds = rng.choice([60.0, 4000.0], len(liked)).cumsum()
    slots = rng.integers(0, 2, len(liked)).cumsum()
    first = np.cumsum([0, *map(len, users)])
    expected: list[int] = []
    for user, start in zip(users, first.tolist(), strict=False):
        state, begun = NEUTRAL, start
        for p, answer in enumerate(user, start):
            if p > start and slots[p] == slots[p - 1]:
                expected.append(expected[-1])
            else:
                waited = seconds[p] - seconds[begun] if p > start else None
                expected.append(mood.of(state, waited))
                begun = p
            state = mood.after(state, answer)

    found = mood.along(first, np.array(liked, dtype=np.int64), seconds, slots)

    assert_array_equal(found, expected)


def test_every_class_can_be_met() -> None:
    mood = Mood(answers=2, memory=2.0, levels=(0.5,), pause_s=60.0)
    met = set()
    for length in range(9):
        for answers in product((0, 1), repeat=length):
            met |= {Feeling(answers, resumed).of(mood) for resumed in (False, True)}

    assert max(met) < mood.classes
    assert mood.classes == 7 * 2 * 2


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"answers": 5}, "answers"),
        ({"memory": 0.5}, "memory"),
        ({"memory": float("nan")}, "memory"),
        ({"levels": (0.5, 0.5)}, "levels"),
        ({"levels": (0.0,)}, "levels"),
        ({"levels": tuple(np.linspace(0.1, 0.9, 17))}, "levels"),
        ({"pause_s": 0.0}, "pause_s"),
    ],
)
def test_a_mood_is_checked(given: Mapping[str, Any], field: str) -> None:
    with pytest.raises(ValueError, match=f"^{field}: "):
        Mood(**given)


def test_a_model_gives_chances_by_mood_and_their_mean() -> None:
    like = np.array([[0.2, 0.4], [0.1, 0.1], [0.5, 1.0]])

    model = in_last(like, mood=LAST, shares=[0.5, 0.3, 0.2])

    assert_array_equal(model.like_in, like)
    assert_array_equal(model.observe_in, np.stack((1 - like, like), axis=2))
    assert_allclose(model.like, [0.23, 0.43], atol=1e-15)
    assert_allclose(model.observe[:, 1], [0.23, 0.43], atol=1e-15)
    assert_allclose(in_last(like, mood=LAST).like, like.mean(axis=0))


@pytest.mark.parametrize(
    ("like", "given", "field"),
    [
        ([0.1, 0.2], {"mood": LAST}, "like"),
        (EVERY[:2], {"mood": LAST}, "like"),
        (EVERY, {}, "like"),
        ([[0.1, 0.2], [0.1, 1.2], [0.1, 0.2]], {"mood": LAST}, "like[1][1]"),
        (EVERY, {"mood": LAST, "shares": [0.5, 0.5]}, "shares"),
        (EVERY, {"mood": LAST, "shares": [0.5, 0.5, 0.5]}, "shares"),
        ([0.1, 0.2], {"shares": [1.0]}, "shares"),
        (
            None,
            {
                "mood": LAST,
                "signals": Signals(NAMES, [[[1.0, 0.0], [0.5, 0.6]]] * 3, (0, 1)),
            },
            "observe[0][1]",
        ),
        (EVERY, {"mood": LAST, "samples": [in_last([0.1, 0.2])]}, "samples[0]"),
    ],
)
def test_the_field_at_fault_is_named(
    like: Sequence[object] | None, given: Mapping[str, Any], field: str
) -> None:
    with pytest.raises(InvalidModel) as raised:
        in_last(like, **given)

    assert raised.value.field == field


def test_models_of_a_set_share_one_mood() -> None:
    first = in_last(EVERY, mood=LAST)
    other = in_last(EVERY, mood=replace(LAST, memory=2.0))

    with pytest.raises(InvalidModel, match=r"^mood: model 2 .* than model 1$"):
        ModelSet.of([in_last([0.1, 0.2]), first, other])


def test_chances_are_stacked_by_model_and_mood() -> None:
    rng = np.random.default_rng(1)
    mood = Mood(answers=1, levels=(0.5,), pause_s=None)
    plain = random_model(rng, 2)
    small, large = (
        moody(telling_model(rng, size, signals), mood, rng)
        for size, signals in ((2, 3), (4, 2))
    )

    stacked = ModelSet.of([plain, small, large])

    assert stacked.classes == mood.classes == 6
    for c in range(6):
        assert_array_equal(stacked.like_in[c, :2], plain.like)
        assert_array_equal(stacked.like_in[6 + c, :2], small.like_in[c])
        assert_array_equal(stacked.observe_in[6 + c, :3, :2], small.observe_in[c].T)
        assert_array_equal(stacked.observe_in[12 + c, :2], large.observe_in[c].T)
    assert_array_equal(stacked.most_like[2], large.like_in.max(axis=0))


def test_without_moods_there_is_one_array() -> None:
    stacked = ModelSet.of(paper(1))

    assert stacked.classes == 1
    assert stacked.like_in is stacked.like
    assert stacked.observe_in is stacked.observe


def test_samples_have_chances_by_mood_of_their_own() -> None:
    rng = np.random.default_rng(2)
    draws = [moody(random_model(rng, 3), LAST, rng) for _ in range(2)]
    parts = (draws[0].states, draws[0].play, draws[0].rest)
    model = Model(*parts, draws[0].like_in, draws[0].prior, mood=LAST, samples=draws)

    together, apart = ModelSet.of([model]), ModelSet.of(draws)

    both = np.concatenate([draw.like_in for draw in draws], axis=1)
    assert_array_equal(together.like_in, both)
    for name in ("like", "like_in", "observe", "observe_in", "rule"):
        assert_array_equal(getattr(together.separated(), name), getattr(apart, name))
    assert_array_equal(together.drawn(1).like_in, draws[1].like_in)


@settings(deadline=None, max_examples=40)
@given(
    MOODS,
    st.lists(
        st.tuples(
            st.booleans(), st.sampled_from([0, 1, 2, NONE]), st.integers(0, 1000)
        ),
        max_size=4,
    ),
    st.integers(0, 2**32),
)
def test_beliefs_are_sums_over_all_hidden_paths(
    mood: Mood, log: list[tuple[bool, int, int]], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    model = moody(telling_model(rng, 3, 3), mood, rng)
    models = ModelSet.of([telling_model(rng, 2, 2), model])
    slots = [Slot(played, signal, c % mood.classes) for played, signal, c in log]
    expected = enumerated_belief(model, slots)
    row = one = np.ones(1, dtype=np.int64)

    belief = untouched(models, 0)[1]
    for slot in slots:
        if slot.played:
            chance = sum(belief[i] * emission(model, i, slot) for i in range(3))
            told = answered(models, 1, belief, slot.signal, slot.mood)
            assert_allclose(told.surprise, -np.log(chance), atol=1e-12)
            belief = told.belief
        else:
            belief = rested(models, row, belief[None], one)[0]
    plays = [t for t, slot in enumerate(slots) if slot.played]
    signals, classes = (
        np.array([getattr(slots[t], name) for t in plays], dtype=np.int64)
        for name in ("signal", "mood")
    )
    after, again = replayed(models, 1, np.array(plays), signals, classes)

    assert_allclose(belief, expected, atol=1e-12)
    again = rested(models, row, again[None], one * (len(slots) - after))[0]
    assert_allclose(again, expected, atol=1e-12)
    c = seed % mood.classes
    (now,) = expected_like(models, row, belief[None], c)
    (then,) = forecast(models, 1, belief, 1, c)
    assert_allclose(now, expected @ model.like_in[c], atol=1e-12)
    assert_allclose(then, expected @ model.rest @ model.like_in[c], atol=1e-12)


@pytest.mark.parametrize("name", POLICIES)
@settings(deadline=None, max_examples=8)
@given(instance=slates(most=3), mood=MOODS, likes=st.integers(0, 5))
def test_a_mood_that_changes_nothing_changes_no_bit(
    name: str, instance: Instance, mood: Mood, likes: int
) -> None:
    without, changed = (
        replace(
            instance,
            models=tuple(even_tempered(model, each) for model in instance.models),
            answers=(1,) * likes,
        ).situation
        for each in (None, mood)
    )

    scores = score(create(name, {}), changed)

    assert_array_equal(scores, score(create(name, {}), without))


@pytest.mark.parametrize("name", ["rollout", "thompson", "whittle_mc"])
def test_samples_whose_moods_change_nothing_are_followed_alike(name: str) -> None:
    plain, belief = uncertain(3, 3, 2), np.full(6, 1 / 6)
    params = {"policy": {"name": "rollout"}} if name == "thompson" else {}

    before, after = (
        score(
            create(name, params),
            Instance((model, model), (0, 1), (belief, belief), (2, 1)).situation,
        )
        for model in (even_tempered(plain, None), even_tempered(plain, LAST))
    )

    assert_array_equal(after, before)


@settings(deadline=None, max_examples=40)
@given(moods(slates(most=4, signals=(2, 3))))
def test_myopic_play_goes_by_the_present_mood(instance: Instance) -> None:
    feeling = Feeling(instance.answers, instance.resumed)
    firsts = Rules(instance, NO_TABLES, 0.9).firsts

    scores = score(create("myopic", {}), instance.situation)

    assert_allclose(scores, [item.reward(feeling) for item in firsts], atol=1e-12)


@pytest.mark.parametrize("name", ["whittle", "lagrangian", "whittle_mc"])
def test_an_index_is_of_the_mean_mood_with_the_reward_of_this_one(name: str) -> None:
    rng = np.random.default_rng(5)
    models = tuple(moody(random_model(rng, 3), LAST, rng) for _ in range(3))
    means = tuple(
        Model(model.states, model.play, model.rest, model.like, model.prior)
        for model in models
    )
    beliefs = tuple(rng.dirichlet(np.ones(3), 3))
    case = Instance(models, (0, 1, 2), beliefs, (1, 1, 1), answers=(0, 1))
    usual = replace(case, models=means)

    scores = score(create(name, {}), case.situation)

    more = [
        belief @ (model.like_in[2] - model.like)
        for model, belief in zip(models, beliefs, strict=True)
    ]
    expected = score(create(name, {}), usual.situation) + more
    assert_allclose(scores, expected, atol=1e-9)


def test_of_models_with_moods_there_is_no_bound() -> None:
    models = (in_last(EVERY, mood=LAST),)
    case = Instance(models, (0,), (np.full(2, 0.5),), (1,)).situation

    with pytest.raises(ValueError, match=r"^mood: "):
        bound(case, 0.9)
