"""What the guard computes, and when it changes its mind, without a service."""

from collections.abc import Iterator
from dataclasses import asdict, replace
from datetime import UTC, datetime
from itertools import pairwise
from math import log

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.services import guard_rules, guard_scores
from app.services.guard_rules import TERMS
from app.services.guard_scores import STRENGTH, Outcome, scored, unpacked
from app.storage.judgements import Judgement, State

NOW = datetime(2026, 1, 1, tzinfo=UTC)
CALM = Judgement("pop", 1, 1, State.CALM, NOW)

outcomes = st.lists(
    st.tuples(
        st.integers(0, 3),
        st.integers(0, 2),
        st.sampled_from([0.0, 0.2, 0.5, 0.75, 1.0]),
        st.sampled_from([0.0, 0.4, 1.0]),
    ),
    min_size=1,
    max_size=40,
)


def packed(told: list[Outcome]) -> guard_scores.Outcomes:
    return unpacked(guard_scores.appended(b"", told, TERMS.window))


def loss(chance: float, reward: float) -> float:
    chance = min(max(chance, 0.001), 0.999)
    return -reward * log(chance) - (1 - reward) * log(1 - chance)


@given(outcomes)
@settings(max_examples=100, deadline=None)
def test_scores_are_those_of_plain_loops(told: list[Outcome]) -> None:
    model, constant, rate = [], [], []
    for number, (user, item, predicted, reward) in enumerate(told):
        before = told[:number]
        mean = (0.5 + sum(r for *_, r in before)) / (number + 1)
        own = [r for u, _, _, r in before if u == user]
        pair = [r for u, i, _, r in before if (u, i) == (user, item)]
        shrunk = (sum(own) + STRENGTH * mean) / (len(own) + STRENGTH)
        shrunk = (sum(pair) + STRENGTH * shrunk) / (len(pair) + STRENGTH)
        model.append(loss(predicted, reward))
        constant.append(loss(mean, reward))
        rate.append(loss(shrunk, reward))
    rival = min(constant, rate, key=sum)
    excess = np.array(model) - np.array(rival)

    found = scored(packed(told))

    assert found.model == pytest.approx(np.mean(model), abs=1e-5)
    assert found.constant == pytest.approx(np.mean(constant), abs=1e-5)
    assert found.rate == pytest.approx(np.mean(rate), abs=1e-5)
    assert found.excess == pytest.approx(
        np.mean(model) - min(np.mean(constant), np.mean(rate)), abs=1e-5
    )
    plain = np.sqrt(((excess - excess.mean()) ** 2).sum()) / len(told)
    if abs(np.sum(constant) - np.sum(rate)) > 1e-4:
        assert found.error >= plain - 1e-5
    assert found.users == len({user for user, *_ in told})


def test_plays_of_one_user_are_no_independent_evidence() -> None:
    """Of ten users, five like everything and five nothing: 1000 plays are as ten."""
    told = [
        (user, number, 0.9, float(user % 2))
        for number in range(100)
        for user in range(10)
    ]

    found = scored(packed(told))
    alone = scored(packed([(n, 0, p, r) for n, (_, _, p, r) in enumerate(told)]))

    assert found.error > 5 * alone.error


def test_calibration_is_told_by_class() -> None:
    told = [(n, 0, 0.25, float(n % 2)) for n in range(1000)]
    told += [(n, 0, 0.75, float(n % 2)) for n in range(1000)]

    found = scored(packed(told))

    assert found.calibration == pytest.approx(0.25)
    assert found.predicted == found.answered == 0.5


def lived(
    seed: int, wrong: float, answers: int, judgement: Judgement = CALM
) -> Iterator[Judgement]:
    """Judgements of a model whose logits are off, step by step; users differ."""
    rng = np.random.default_rng(seed)
    leaning = rng.normal(0, 0.3, 50)
    for _ in range(answers // TERMS.step):
        user = rng.integers(0, 50, TERMS.step)
        logit = rng.normal(0, 1, TERMS.step)
        chance = 1 / (1 + np.exp(-logit - leaning[user]))
        predicted = 1 / (1 + np.exp(-logit * (1 - wrong)))
        reward = (rng.random(TERMS.step) < chance).astype(float)
        item = rng.integers(0, 20, TERMS.step)
        told = zip(user, item, predicted, reward, strict=True)
        judgement = replace(
            judgement,
            fresh=judgement.fresh + TERMS.step,
            outcomes=guard_scores.appended(judgement.outcomes, told, TERMS.window),
        )
        if guard_rules.is_due(judgement, TERMS):
            scores = scored(unpacked(judgement.outcomes))
            judgement = guard_rules.looked(judgement, scores, TERMS, NOW)
        yield judgement


def changes(judgements: list[Judgement]) -> int:
    return sum(a.state is not b.state for a, b in pairwise(judgements))


def test_a_model_that_is_right_raises_no_alarm() -> None:
    """400 looks of 20 models, though each knows nothing of how its users differ."""
    for seed in range(20):
        judged = list(lived(seed, wrong=0.0, answers=5000))

        assert judged[-1].scores is not None
        assert {one.state for one in judged} == {State.CALM}


def test_a_model_on_the_threshold_does_not_flap() -> None:
    """With logits of about nothing it is as good as a constant.

    In 40 000 answers it may come to raise an alarm, but never goes to and fro.
    """
    for wrong in (0.9, 1.0, 1.05, 1.1, 1.15, 1.2, 1.3):
        judged = list(lived(3, wrong, answers=40_000))

        assert changes(judged) <= 1, wrong


def test_a_model_that_is_wrong_raises_an_alarm_with_the_second_look() -> None:
    states = [one.state for one in lived(0, wrong=2.0, answers=1000)]

    assert states == [State.CALM, State.CALM, State.ALARM, State.ALARM]


def test_an_alarm_ends_by_later_answers_only_and_each_fall_makes_that_harder() -> None:
    alarm = list(lived(0, wrong=2.0, answers=750))[-1]
    assert alarm.state is State.ALARM
    assert alarm.outcomes == b""

    ends = []
    for falls in (1, 2, 3):
        again = lived(1, 0.0, 5000, replace(alarm, falls=falls))
        states = [one.state for one in again]
        ends.append(states.index(State.CALM))

    assert ends == [2, 4, 8]


def test_what_is_kept_of_scores_is_read_again() -> None:
    found = scored(packed([(1, 1, 0.5, 1.0), (2, 1, 0.25, 0.0)]))

    assert guard_scores.of(asdict(found)) == found
